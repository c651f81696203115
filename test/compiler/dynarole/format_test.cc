// The layout of DynaRole: known texts, and properties that hold for every text of the repository.

#include "compiler/dynarole/format.h"

#include <gtest/gtest.h>

#include <set>

#include "compiler/dynarole/compile.h"
#include "compiler/dynarole/lexer.h"
#include "test/compiler/dynarole/fake_host.h"
#include "test/support/format_texts.h"
#include "vm/image/image.h"

namespace morphbus::dynarole {
namespace {

const test::FormattedLanguage& Language() {
  static const test::FormattedLanguage kDynaRole = {
      ".dyn", Format, [](const source::SourceSet& sources, int file) {
        source::Diagnostics diagnostics;
        std::vector<std::string> texts;
        for (const Token& token : Tokenize(sources, file, &diagnostics)) {
          texts.emplace_back(sources.text(token.span));
        }
        return texts;
      }};
  return kDynaRole;
}

std::optional<std::string> FormatText(const std::string& text) {
  return test::FormatText(Language(), text);
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

TEST(Format, LaysOutSwitchesEnumerationsAndChoices) {
  EXPECT_EQ(FormatText("enum Phase{LIFT,SWING=-1,}\nenum Side { A };\n"
                       "function f(x){return x>0?-1:x<0 ? 1:0;}"
                       "role R extends Module{p=LIFT;case=1;behavior b(){switch(p){case LIFT,-1: "
                       "p=SWING;// up\nif(p==2){p=3;}\n"
                       "case p>1?2:3:break;\n\n// else\ndefault:switch(case){default:case=2;}}"
                       "case=-1;if(p>1)switch(p){case 1:p=2;p=3;}p=p>1?case-1:p>2?default:case;}}"),
            "enum Phase { LIFT, SWING = -1, }\n"
            "enum Side { A };\n"
            "function f(x) {\n"
            "  return x > 0 ? -1 : x < 0 ? 1 : 0;\n"
            "}\n"
            "role R extends Module {\n"
            "  p = LIFT;\n"
            "  case = 1;\n"
            "  behavior b() {\n"
            "    switch (p) {\n"
            "      case LIFT, -1:\n"
            "        p = SWING;  // up\n"
            "        if (p == 2) {\n"
            "          p = 3;\n"
            "        }\n"
            "      case p > 1 ? 2 : 3:\n"
            "        break;\n"
            "\n"
            "      // else\n"
            "      default:\n"
            "        switch (case) {\n"
            "          default:\n"
            "            case = 2;\n"
            "        }\n"
            "    }\n"
            "    case = -1;\n"
            "    if (p > 1) switch (p) {\n"
            "      case 1:\n"
            "        p = 2;\n"
            "        p = 3;\n"
            "    }\n"
            "    p = p > 1 ? case - 1 : p > 2 ? default : case;\n"
            "  }\n"
            "}\n");
}

TEST(Format, ElementsStandCloseToTheirArrays) {
  EXPECT_EQ(
      FormatText("param p=1 in[0,3];role R extends Module{a=[1,2];b[4]=-1;trace a [1];"
                 "startup go(){a [0]=a [1]-1;a[1]-=-a[0];for(n in self.connected)print(n);}}"),
      "param p = 1 in [0, 3];\n"
      "role R extends Module {\n"
      "  a = [1, 2];\n"
      "  b[4] = -1;\n"
      "  trace a[1];\n"
      "  startup go() {\n"
      "    a[0] = a[1] - 1;\n"
      "    a[1] -= -a[0];\n"
      "    for (n in self.connected) print(n);\n"
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

/// The part of an image that runs, but for its hash and that of the notes, which have the lines.
std::vector<uint8_t> ProgramOf(const std::optional<std::vector<uint8_t>>& image) {
  if (!image) return {};
  const auto at = [&](uint32_t i) { return image->begin() + static_cast<std::ptrdiff_t>(i); };
  const uint32_t size = vm::image::ReadU32(image->data() + vm::image::kSizeAt);
  EXPECT_GT(size, vm::image::kHeaderBytes);
  std::vector<uint8_t> program(at(vm::image::kBudgetAt), at(vm::image::kHashAt));
  program.insert(program.end(), at(vm::image::kCountsAt), at(size));
  return program;
}

/// What a text compiles to, and what is said of it, without places.
std::pair<std::vector<uint8_t>, std::multiset<std::string>> Meaning(const std::string&,
                                                                    const std::string& text) {
  const CompileResult result = CompileProgram("x.dyn", text, TestKeywords());
  std::multiset<std::string> messages;
  for (const auto& d : result.diagnostics.all()) messages.insert(d.message);
  return {ProgramOf(result.image), messages};
}

TEST(Format, ChangesNoProgramAndNothingTheSecondTime) {
  EXPECT_GT(
      test::ExpectFormattingKeeps(
          Language(), {"models/programs", "test/programs", "test/malformed/dynarole"}, Meaning),
      30);
}

TEST(Format, DependsOnTokensAndCommentsOnly) {
  test::ExpectTokensAloneDecide(Language(), "models/programs");
  test::ExpectTokensAloneDecide(Language(), "test/programs");
}

TEST(Format, HasBeenAppliedToThePrograms) { test::ExpectFormatted(Language(), "models/programs"); }

}  // namespace
}  // namespace morphbus::dynarole
