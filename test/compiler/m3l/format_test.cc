// The layout of M3L: known texts, and properties that hold for every text of the repository.

#include "compiler/m3l/format.h"

#include <gtest/gtest.h>

#include <set>

#include "compiler/m3l/compile.h"
#include "compiler/m3l/lexer.h"
#include "compiler/model/forward_kinematics.h"
#include "test/support/format_texts.h"

namespace morphbus::m3l {
namespace {

const test::FormattedLanguage& Language() {
  static const test::FormattedLanguage kM3l = {
      ".m3l", Format, [](const source::SourceSet& sources, int file) {
        source::Diagnostics diagnostics;
        std::vector<std::string> texts;
        for (const Token& token : Tokenize(sources, file, kMaxTokens, &diagnostics)) {
          texts.emplace_back(token.text);
        }
        return texts;
      }};
  return kM3l;
}

std::optional<std::string> FormatText(const std::string& text) {
  return test::FormatText(Language(), text);
}

TEST(Format, SpacesTokensAlike) {
  EXPECT_EQ(FormatText("module  M :unit=.5\npoint p:coords=( 1,-2,2*-3 ),connector,size=1+2-3/4\n"),
            "module M: unit=.5\n"
            "point p: coords=(1, -2, 2*-3), connector, size=1 + 2 - 3/4\n");
  EXPECT_EQ(FormatText("connection C: members=(M a,M b), conditions=(not(a.point p coincident b"
                       ".point q)and(p.size>=-1 or p.kind!=\"x\"))"),
            "connection C:\n"
            "  members=(M a, M b),\n"
            "  conditions=(not (a.point p coincident b.point q) and (p.size >= -1 or p.kind != "
            "\"x\"))\n");
  EXPECT_EQ(FormatText("robot r:modules=(M m1),connections=((m1.c,m2.d,C : 3)),"
                       "frame=(m1.l.(axis:origin=(0,0,0)))"),
            "robot r: modules=(M m1), connections=((m1.c, m2.d, C:3)), "
            "frame=(m1.l.(axis: origin=(0, 0, 0)))\n");
}

TEST(Format, GivesPartsOfAShapeALineEachWhereOneIsTooShort) {
  EXPECT_EQ(FormatText("module M:\nlink l: hull=box(size=(1,1,1))+sphere(radius=1),mass=1\n"),
            "module M:\nlink l: hull=box(size=(1, 1, 1)) + sphere(radius=1), mass=1\n");
  EXPECT_EQ(FormatText("module M:\nlink l: mass=1, visual=box(size=(1,1,1))+sphere(radius=1,colour="
                       "\"#102030\")+mesh(\"a.stl\",colour=\"#102030\")\n"),
            "module M:\n"
            "link l: mass=1, visual=box(size=(1, 1, 1))\n"
            "        + sphere(radius=1, colour=\"#102030\")\n"
            "        + mesh(\"a.stl\", colour=\"#102030\")\n");
}

TEST(Format, BreaksLongStatementsAtPartsAndAligns) {
  EXPECT_EQ(FormatText("point c1: (point _1: coords=(-1,1,1)) (point _2: coords=(-2,0,1)) (point "
                       "_3: coords=(-1,-1,1)) coords=(-1,0,1), connector, gender=\"male\"\n"),
            std::nullopt)
      << "a member outside of a module does not parse";
  EXPECT_EQ(
      FormatText("module M:\npoint c1: (point _1: coords=(-1,1,1)) (point _2: "
                 "coords=(-2,0,1)) (point "
                 "_3: coords=(-1,-1,1)) (point _4: coords=(0,0,1)) coords=(-1,0,1), connector, "
                 "gender=\"male\"\n"),
      "module M:\n"
      "point c1: (point _1: coords=(-1, 1, 1)) (point _2: coords=(-2, 0, 1))\n"
      "          (point _3: coords=(-1, -1, 1)) (point _4: coords=(0, 0, 1))\n"
      "          coords=(-1, 0, 1), connector, gender=\"male\"\n");
}

TEST(Format, KeepsCommentsWhereTheyStand) {
  EXPECT_EQ(FormatText("// file\n\n\n# head   \nmodule M: /* in */ unit=1 // tail\n"
                       "// before p\npoint p: coords=(0,0,0), // first\n  // own line\n connector\n"
                       "/* two\n   lines */\n\n// end\n\n"),
            "// file\n\n# head\nmodule M: /* in */ unit=1  // tail\n"
            "// before p\npoint p: coords=(0, 0, 0),  // first\n"
            "         // own line\n         connector\n"
            "/* two\n   lines */\n\n// end\n");
  EXPECT_EQ(FormatText(""), "");
  EXPECT_EQ(FormatText("\n\n// only\n\n"), "// only\n");
}

TEST(Format, RefusesWhatDoesNotParse) {
  EXPECT_EQ(FormatText("module M: unit=\n"), std::nullopt);
  EXPECT_EQ(FormatText("module M: unit=(1\n"), std::nullopt);
  EXPECT_EQ(FormatText("/* open"), std::nullopt);
}

/// What a text compiles to, or why it does not, without places.
std::string Meaning(const std::string& name, const std::string& text) {
  const CompileOutput output = CompileText(name, text);
  std::string meaning;
  std::multiset<std::string> messages;
  for (const source::Diagnostic& d : output.diagnostics.all()) messages.insert(d.message);
  for (const std::string& message : messages) meaning += message + "\n";
  if (!output.model) return meaning;
  const auto add = [&](const auto& value) { meaning += std::to_string(value) + " "; };
  for (const model::ModuleType& type : output.model->module_types) {
    meaning += type.name + " ";
    for (const model::Link& link : type.links) {
      add(link.mass_kg);
      for (const Eigen::Vector3d& p : link.hull) add(p.dot(Eigen::Vector3d(1.0, 3.0, 7.0)));
    }
    for (const model::Joint& joint : type.joints) add(joint.lower + 2 * joint.upper);
  }
  for (const model::ConnectionType& type : output.model->connection_types) {
    add(type.candidates);
    for (const model::ConnectionOption& option : type.options) {
      add((option.X_AB * Eigen::Vector3d(1.0, 3.0, 7.0)).sum());
    }
  }
  for (const model::Robot& robot : output.model->robots) {
    meaning += robot.name + " ";
    const auto state = model::ForwardKinematics(*output.model, robot, model::StartValues(robot));
    for (const auto& links : state.X_RL) {
      for (const model::Pose& X : links) add((X * Eigen::Vector3d(1.0, 3.0, 7.0)).sum());
    }
  }
  return meaning;
}

TEST(Format, ChangesNoMeaningAndNothingTheSecondTime) {
  EXPECT_GT(
      test::ExpectFormattingKeeps(
          Language(), {"models", "test/malformed/m3l", "test/compiler/m3l/listings"}, Meaning),
      70);
}

TEST(Format, DependsOnTokensAndCommentsOnly) {
  test::ExpectTokensAloneDecide(Language(), "models");
}

TEST(Format, ReadsLinesThatEndWithCarriageReturns) {
  EXPECT_EQ(FormatText("// a\rmodule A: // b\r\rlink l: mass=1\r\n/* c\rd */\r"),
            "// a\nmodule A:  // b\n\nlink l: mass=1\n/* c\nd */\n");
}

TEST(Format, HasBeenAppliedToTheModels) { test::ExpectFormatted(Language(), "models"); }

}  // namespace
}  // namespace morphbus::m3l
