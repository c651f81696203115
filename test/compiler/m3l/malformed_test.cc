// The corpus of broken models: test/malformed/m3l/*.m3l. Each file says in `// expect: LINE: part`
// comments which errors it has: exactly these, on these lines. A file with no such comment only
// must not crash the compiler (inputs that once did).

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "compiler/m3l/compile.h"

namespace morphbus::m3l {
namespace {

std::filesystem::path CorpusDirectory() {
  return std::filesystem::path(MORPHBUS_SOURCE_DIR) / "test/malformed/m3l";
}

std::vector<std::string> CorpusFiles() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(CorpusDirectory())) {
    if (entry.path().extension() == ".m3l") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

struct Expectation {
  int line = 0;
  std::string part;
};

std::vector<Expectation> ReadExpectations(const std::filesystem::path& path) {
  std::vector<Expectation> expectations;
  std::ifstream file(path);
  const std::string marker = "// expect: ";
  for (std::string line; std::getline(file, line);) {
    if (line.compare(0, marker.size(), marker) != 0) continue;
    const size_t colon = line.find(": ", marker.size());
    expectations.push_back({std::stoi(line.substr(marker.size())), line.substr(colon + 2)});
  }
  return expectations;
}

class MalformedTest : public ::testing::TestWithParam<std::string> {};

TEST_P(MalformedTest, HasExactlyTheErrorsItExpects) {
  const std::filesystem::path path = CorpusDirectory() / (GetParam() + ".m3l");
  std::vector<Expectation> expected = ReadExpectations(path);
  const CompileOutput output = CompileFiles({path.string()});
  EXPECT_FALSE(output.model.has_value());
  const std::string text = source::Render(output.diagnostics, output.sources, false);
  for (const source::Diagnostic& d : output.diagnostics.all()) {
    if (d.severity != source::Severity::kError) continue;
    ASSERT_EQ(d.span.file, 0) << text;
    const int line = output.sources.Locate(d.span.file, d.span.begin).line;
    const auto it = std::find_if(expected.begin(), expected.end(), [&](const Expectation& e) {
      return e.line == line && d.message.find(e.part) != std::string::npos;
    });
    if (it == expected.end()) {
      ADD_FAILURE() << "unexpected, on line " << line << ": " << d.message << "\n" << text;
    } else {
      expected.erase(it);
    }
  }
  for (const Expectation& e : expected) {
    ADD_FAILURE() << "missing, on line " << e.line << ": " << e.part << "\n" << text;
  }
}

INSTANTIATE_TEST_SUITE_P(Corpus, MalformedTest, ::testing::ValuesIn(CorpusFiles()),
                         [](const auto& test_case) { return test_case.param; });

}  // namespace
}  // namespace morphbus::m3l
