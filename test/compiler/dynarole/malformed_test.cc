// Broken programs: each file in test/malformed/dynarole must yield exactly the diagnostics that its
// `// expect: LINE: text` comments announce (text is part of "error: ..." or "warning: ..." or of
// the hint), no more and no fewer. `// expect: FILE:LINE: text` is about a file that is imported.
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
  std::string file;  ///< Empty: the program's own.
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
    const std::string place = line.substr(at + mark.size(), colon - at - mark.size());
    const size_t file = place.rfind(':');
    const bool own = file == std::string::npos;
    expectations.push_back({own ? "" : place.substr(0, file),
                            std::stoi(own ? place : place.substr(file + 1)),
                            line.substr(colon + 2)});
  }
  return expectations;
}

class BrokenProgram : public ::testing::TestWithParam<std::string> {};

TEST_P(BrokenProgram, YieldsExactlyTheExpectedDiagnostics) {
  const std::string name = test::SourcePath("test/malformed/dynarole/") + GetParam() + ".dyn";
  std::ifstream file(name);
  std::stringstream text;
  text << file.rdbuf();
  std::vector<Expectation> expectations = ExpectationsIn(text.str());
  ASSERT_FALSE(expectations.empty()) << "the file expects nothing";

  const CompileResult result = CompileProgram(name, text.str(), TestKeywords());
  const std::string rendered = Render(result.diagnostics, result.sources, false);
  EXPECT_EQ(result.image.has_value(), !result.diagnostics.had_errors()) << rendered;
  for (const source::Diagnostic& diagnostic : result.diagnostics.all()) {
    const int file_number = diagnostic.span.file;
    const int line = result.sources.Locate(file_number, diagnostic.span.begin).line;
    const std::string in = file_number == 0 ? "" : result.sources.NameFromFirst(file_number);
    const std::string found =
        (diagnostic.severity == source::Severity::kError ? "error: " : "warning: ") +
        diagnostic.message + " (" + diagnostic.hint + ")";
    const auto it =
        std::find_if(expectations.begin(), expectations.end(), [&](const Expectation& expectation) {
          return expectation.file == in && expectation.line == line &&
                 found.find(expectation.text) != std::string::npos;
        });
    if (it == expectations.end()) {
      ADD_FAILURE() << "not expected: " << in << " line " << line << ": " << found << "\n"
                    << rendered;
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
