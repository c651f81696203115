// Programs with their expectations: each file in test/programs is compiled without a diagnostic
// (but those it announces by `// warns`), its role Test is run on a fake module, and the events
// must be exactly its `// expect:` lines, in order.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "compiler/dynarole/compile.h"
#include "test/compiler/dynarole/fake_host.h"
#include "test/support/doc_examples.h"
#include "test/support/source_dir.h"
#include "vm/image/verifier.h"

namespace morphbus::dynarole {
namespace {

std::vector<std::string> ProgramFiles() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(test::SourcePath("test/programs"))) {
    if (entry.path().extension() == ".dyn") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

class ProgramFile : public ::testing::TestWithParam<std::string> {};

TEST_P(ProgramFile, DoesWhatItSays) {
  const std::string path = test::SourcePath("test/programs/") + GetParam() + ".dyn";
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();

  const CompileResult result = CompileProgram(path, text.str(), TestKeywords());
  const bool may_warn = text.str().find("// warns") != std::string::npos;
  ASSERT_TRUE(result.image && (may_warn || result.diagnostics.all().empty()))
      << Render(result.diagnostics, result.sources, false);
  const auto program = std::make_unique<vm::VerifiedProgram>();
  const vm::VerifyError error = vm::Verifier::Verify(
      result.image->data(), static_cast<uint32_t>(result.image->size()), program.get());
  ASSERT_EQ(error.message, nullptr) << error.message;

  std::vector<std::string> expected;
  std::string line;
  const std::string mark = "// expect: ";
  while (std::getline(text, line)) {
    const size_t at = line.find(mark);
    if (at != std::string::npos) expected.push_back(line.substr(at + mark.size()));
  }
  EXPECT_EQ(RunRole(*program, "Test"), expected);
}

/// The events that the comments of a text announce.
std::vector<std::string> ExpectedIn(const std::string& text) {
  std::vector<std::string> expected;
  std::istringstream lines(text);
  std::string line;
  const std::string mark = "// expect: ";
  while (std::getline(lines, line)) {
    const size_t at = line.find(mark);
    if (at != std::string::npos) expected.push_back(line.substr(at + mark.size()));
  }
  return expected;
}

// What the documentation shows is run like the files of test/programs: the last concrete role.
TEST(Documentation, ExamplesDoWhatTheySay) {
  const std::vector<test::DocExample> examples = test::DocExamples("docs/dynarole.md");
  EXPECT_GE(examples.size(), 5u);
  for (const test::DocExample& example : examples) {
    SCOPED_TRACE("docs/dynarole.md:" + std::to_string(example.line));
    // What has a name is for others to import.
    if (!example.name.empty()) continue;
    const auto read = [&examples](const std::string& path) -> Result<std::string> {
      for (const test::DocExample& other : examples) {
        if (other.name == path) return other.text;
      }
      return Fail("the document has no " + path);
    };
    const CompileResult result =
        CompileProgram("example.dyn", example.text, TestKeywords(), Dump::kNone, nullptr, read);
    ASSERT_TRUE(result.image && result.diagnostics.all().empty())
        << Render(result.diagnostics, result.sources, false);
    const auto program = std::make_unique<vm::VerifiedProgram>();
    vm::Verifier::Verify(result.image->data(), static_cast<uint32_t>(result.image->size()),
                         program.get());
    int last = program->num_roles() - 1;
    while (last > 0 && program->role(last).abstract_role) --last;
    EXPECT_EQ(RunRoleNumber(*program, last), ExpectedIn(example.text));
  }
}

INSTANTIATE_TEST_SUITE_P(All, ProgramFile, ::testing::ValuesIn(ProgramFiles()),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace morphbus::dynarole
