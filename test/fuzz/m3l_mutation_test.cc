// The structure-aware mutations at work without libFuzzer: every model and every broken model,
// mutated a few times by fixed seeds, ends in a model or in errors, and what compiles or does not
// is laid out without a change of meaning.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "compiler/m3l/format.h"
#include "test/fuzz/m3l_mutator.h"
#include "test/support/source_dir.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace morphbus::test {
namespace {

constexpr size_t kMaxSize = 8000;

std::vector<std::string> Corpus() {
  std::vector<std::filesystem::path> paths;
  for (const char* folder : {"models", "test/malformed/m3l"}) {
    const std::filesystem::path place = test::SourcePath(folder);
    for (const auto& entry : std::filesystem::directory_iterator(place)) {
      if (entry.path().extension() == ".m3l") paths.push_back(entry.path());
    }
  }
  std::sort(paths.begin(), paths.end());
  std::vector<std::string> texts;
  for (const auto& path : paths) {
    std::ifstream in(path, std::ios::binary);
    texts.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }
  return texts;
}

void Try(const std::string& text) {
  LLVMFuzzerTestOneInput(reinterpret_cast<const uint8_t*>(text.data()), text.size());
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const std::optional<std::string> once =
      m3l::Format(sources, sources.AddText("once", text), &diagnostics);
  ASSERT_EQ(once.has_value(), !diagnostics.had_errors()) << text;
  for (const source::Diagnostic& d : diagnostics.all()) {
    EXPECT_EQ(d.message.find("cannot be laid out"), std::string::npos) << text;
  }
  if (!once) return;
  source::SourceSet again;
  EXPECT_EQ(m3l::Format(again, again.AddText("twice", *once), &diagnostics), once) << text;
}

TEST(M3lMutations, EndInAModelOrInErrors) {
  uint32_t seed = 1;
  for (const std::string& text : Corpus()) {
    for (int i = 0; i < 5; ++i) Try(MutateM3l(text, seed++, kMaxSize));
  }
}

TEST(M3lMutations, AreReproducibleAndMostlyParse) {
  int parsed = 0, tried = 0;
  for (const std::string& text : Corpus()) {
    for (uint32_t seed = 0; seed < 3; ++seed) {
      const std::string mutated = MutateM3l(text, seed, kMaxSize);
      EXPECT_EQ(mutated, MutateM3l(text, seed, kMaxSize));
      EXPECT_LE(mutated.size(), kMaxSize);
      source::SourceSet sources;
      source::Diagnostics diagnostics;
      parsed += m3l::Format(sources, sources.AddText("x", mutated), &diagnostics) ? 1 : 0;
      ++tried;
    }
  }
  EXPECT_GT(parsed, tried / 4);
  EXPECT_LT(parsed, tried);
}

TEST(M3lMutations, CrossTexts) {
  const std::vector<std::string> corpus = Corpus();
  for (uint32_t i = 0; i + 7 < corpus.size(); i += 3) {
    Try(CrossM3l(corpus[i], corpus[i + 7], i, kMaxSize));
  }
  Try(CrossM3l("", "", 0, kMaxSize));
  Try(MutateM3l("", 0, kMaxSize));
  Try(MutateM3l("\xff\xfe (((", 3, kMaxSize));
}

}  // namespace
}  // namespace morphbus::test
