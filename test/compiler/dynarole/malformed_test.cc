// Broken programs: each file in test/malformed/dynarole must yield exactly the diagnostics that its
// `// expect: LINE: text` comments announce (text is part of "error: ..." or "warning: ..." or of
// the hint), no more and no fewer.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "compiler/dynarole/compile.h"
#include "test/compiler/dynarole/fake_host.h"
#include "test/support/source_dir.h"

namespace morphbus::dynarole {
namespace {

std::vector<std::string> BrokenFiles() {
  std::vector<std::string> names;
  for (const auto& entry :
       std::filesystem::directory_iterator(test::SourcePath("test/malformed/dynarole"))) {
    if (entry.path().extension() == ".dyn") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

struct Expectation {
  int line = 0;
  std::string text;
};

std::vector<Expectation> ExpectationsIn(const std::string& text) {
  std::vector<Expectation> expectations;
  const std::string mark = "// expect: ";
  std::istringstream lines(text);
  std::string line;
  while (std::getline(lines, line)) {
    const size_t at = line.find(mark);
    if (at == std::string::npos) continue;
    const size_t colon = line.find(": ", at + mark.size());
    if (colon == std::string::npos) continue;
    expectations.push_back({std::stoi(line.substr(at + mark.size())), line.substr(colon + 2)});
  }
  return expectations;
}

class BrokenProgram : public ::testing::TestWithParam<std::string> {};

TEST_P(BrokenProgram, YieldsExactlyTheExpectedDiagnostics) {
  const std::string name = GetParam() + ".dyn";
  std::ifstream file(test::SourcePath("test/malformed/dynarole/") + name);
  std::stringstream text;
  text << file.rdbuf();
  std::vector<Expectation> expectations = ExpectationsIn(text.str());
  ASSERT_FALSE(expectations.empty()) << "the file expects nothing";

  const CompileResult result = CompileProgram(name, text.str(), TestKeywords());
  const std::string rendered = Render(result.diagnostics, result.sources, false);
  EXPECT_EQ(result.image.has_value(), !result.diagnostics.had_errors()) << rendered;
  for (const source::Diagnostic& diagnostic : result.diagnostics.all()) {
    const int line = result.sources.Locate(0, diagnostic.span.begin).line;
    const std::string found =
        (diagnostic.severity == source::Severity::kError ? "error: " : "warning: ") +
        diagnostic.message + " (" + diagnostic.hint + ")";
    const auto it =
        std::find_if(expectations.begin(), expectations.end(), [&](const Expectation& expectation) {
          return expectation.line == line && found.find(expectation.text) != std::string::npos;
        });
    if (it == expectations.end()) {
      ADD_FAILURE() << "not expected: line " << line << ": " << found << "\n" << rendered;
    } else {
      expectations.erase(it);
    }
  }
  for (const Expectation& missing : expectations) {
    ADD_FAILURE() << "missing: line " << missing.line << ": " << missing.text << "\n" << rendered;
  }
}

INSTANTIATE_TEST_SUITE_P(All, BrokenProgram, ::testing::ValuesIn(BrokenFiles()),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace morphbus::dynarole
