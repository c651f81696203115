// The layout of DynaRole: known texts, and properties that hold for every text of the repository.

#include "compiler/dynarole/format.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "compiler/dynarole/compile.h"
#include "compiler/dynarole/lexer.h"
#include "test/compiler/dynarole/fake_host.h"
#include "vm/image.h"

namespace morphbus::dynarole {
namespace {

std::optional<std::string> FormatText(const std::string& text) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const int file = sources.AddText("x.dyn", text);
  std::optional<std::string> formatted = Format(sources, file, diagnostics);
  EXPECT_EQ(formatted.has_value(), !diagnostics.had_errors());
  return formatted;
}

std::string Read(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<std::filesystem::path> FilesIn(const std::string& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(MORPHBUS_SOURCE_DIR) / folder)) {
    if (entry.path().extension() == ".dyn") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

TEST(Format, LaysOutBlocksAndExpressions) {
  EXPECT_EQ(FormatText("role R extends Module{x=-1;y;require(sizeof(self.connected)==4);\n"
                       "startup go(){if(x<2&&!y){stop( );}else if(x>-2)self.go(x,-1);else{}"
                       "while(x*2+1>3);return;}command c(int a,b){var z=a-b;}}"),
            "role R extends Module {\n"
            "  x = -1;\n"
            "  y;\n"
            "  require (sizeof(self.connected) == 4);\n"
            "  startup go() {\n"
            "    if (x < 2 && !y) {\n"
            "      stop();\n"
            "    } else if (x > -2) self.go(x, -1);\n"
            "    else {}\n"
            "    while (x * 2 + 1 > 3) ;\n"
            "    return;\n"
            "  }\n"
            "  command c(int a, b) {\n"
            "    var z = a - b;\n"
            "  }\n"
            "}\n");
}

TEST(Format, KeepsCommentsAndSingleEmptyLines) {
  EXPECT_EQ(FormatText("// head\n\n\nrole R extends Module {\n\n  x = 1;   // tail\n\n\n"
                       "  // own\n  y = /* in */ 2;\n\n  // last\n\n}\n\n// end"),
            "// head\n\nrole R extends Module {\n  x = 1;  // tail\n\n"
            "  // own\n  y = /* in */ 2;\n\n  // last\n}\n\n// end\n");
}

TEST(Format, BreaksLongLinesBehindCommasAndBeforeOperators) {
  const std::optional<std::string> text = FormatText(
      "role R extends Module { startup s() { "
      "self.jointRotateDegreesNonBlocking(upper_joint_of_this_"
      "leg, raise_thigh_by_degrees, some_more_degrees); if (first_condition_of_many == 1 && "
      "second_condition"
      "_of_many == 2 && third_condition_of_many == 3) f(); } }");
  EXPECT_EQ(
      text,
      "role R extends Module {\n"
      "  startup s() {\n"
      "    self.jointRotateDegreesNonBlocking(upper_joint_of_this_leg, raise_thigh_by_degrees,\n"
      "                                       some_more_degrees);\n"
      "    if (first_condition_of_many == 1 && second_condition_of_many == 2\n"
      "        && third_condition_of_many == 3) f();\n"
      "  }\n"
      "}\n");
}

TEST(Format, RefusesWhatDoesNotParse) {
  EXPECT_EQ(FormatText("role R extends Module {"), std::nullopt);
  EXPECT_EQ(FormatText("role R extends Module { x = ; }"), std::nullopt);
}

/// An image but for its hash and size, and its last section: the source line of each instruction.
std::vector<uint8_t> ProgramOf(const std::optional<std::vector<uint8_t>>& image) {
  if (!image) return {};
  const auto at = [&](uint32_t i) { return image->begin() + static_cast<std::ptrdiff_t>(i); };
  const uint32_t entry =
      vm::image::kSectionsAt + 8 * static_cast<uint32_t>(vm::image::Section::kLines);
  uint32_t lines = 0;
  for (uint32_t i = 0; i < 4; ++i) lines |= uint32_t{(*image)[entry + i]} << (8 * i);
  EXPECT_GT(lines, vm::image::kHeaderBytes);
  std::vector<uint8_t> program(at(vm::image::kBudgetAt), at(vm::image::kHashAt));
  program.insert(program.end(), at(vm::image::kSourceNameAt), at(entry));
  program.insert(program.end(), at(vm::image::kHeaderBytes), at(lines));
  return program;
}

TEST(Format, ChangesNoProgramAndNothingTheSecondTime) {
  int formatted_files = 0;
  for (const char* folder : {"models/programs", "test/programs", "test/malformed/dynarole"}) {
    for (const std::filesystem::path& path : FilesIn(folder)) {
      SCOPED_TRACE(path.string());
      const std::string text = Read(path);
      source::SourceSet sources;
      source::Diagnostics diagnostics;
      const std::optional<std::string> once =
          Format(sources, sources.AddText(path.string(), text), diagnostics);
      if (!once) continue;  // Of the broken ones, those with syntax errors.
      ++formatted_files;
      EXPECT_EQ(FormatText(*once), *once);
      const CompileResult before = CompileProgram("x.dyn", text, TestKeywords());
      const CompileResult after = CompileProgram("x.dyn", *once, TestKeywords());
      EXPECT_EQ(ProgramOf(before.image), ProgramOf(after.image));
      std::multiset<std::string> messages_before, messages_after;
      for (const auto& d : before.diagnostics.all()) messages_before.insert(d.message);
      for (const auto& d : after.diagnostics.all()) messages_after.insert(d.message);
      EXPECT_EQ(messages_before, messages_after);
    }
  }
  EXPECT_GT(formatted_files, 30);
}

TEST(Format, DependsOnTokensAndCommentsOnly) {
  for (const char* folder : {"models/programs", "test/programs"}) {
    for (const std::filesystem::path& path : FilesIn(folder)) {
      SCOPED_TRACE(path.string());
      source::SourceSet sources;
      source::Diagnostics diagnostics;
      const int file = sources.AddText(path.string(), Read(path));
      std::string lines, plain, comments;
      for (const Token& token : Tokenize(sources, file, &diagnostics)) {
        const std::string text(sources.text(token.span));
        lines += text + "\n";
        plain += text + " ";
        comments += text + " // c\n";
      }
      const std::optional<std::string> from_lines = FormatText(lines);
      ASSERT_TRUE(from_lines.has_value());
      EXPECT_EQ(from_lines, FormatText(plain));
      const std::optional<std::string> commented = FormatText(comments);
      ASSERT_TRUE(commented.has_value());
      EXPECT_EQ(FormatText(*commented), commented);
    }
  }
}

TEST(Format, HasBeenAppliedToThePrograms) {
  for (const std::filesystem::path& path : FilesIn("models/programs")) {
    const std::string text = Read(path);
    EXPECT_EQ(FormatText(text), text) << "mend with: morphbus format " << path;
  }
}

}  // namespace
}  // namespace morphbus::dynarole
