// The layout of M3L: known texts, and properties that hold for every text of the repository.

#include "compiler/m3l/format.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "compiler/m3l/compile.h"
#include "compiler/m3l/lexer.h"
#include "compiler/model/forward_kinematics.h"

namespace morphbus::m3l {
namespace {

std::optional<std::string> FormatText(const std::string& text) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const int file = sources.AddText("x.m3l", text);
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
    if (entry.path().extension() == ".m3l") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
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
  int formatted_files = 0;
  for (const char* folder : {"models", "test/malformed/m3l", "test/compiler/m3l/listings"}) {
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
      EXPECT_EQ(Meaning(path.string(), *once), Meaning(path.string(), text));
    }
  }
  EXPECT_GT(formatted_files, 70);
}

/// Any two tokens may come apart or together: each text once with every token on its own line, and
/// once with a comment behind every token.
TEST(Format, DependsOnTokensAndCommentsOnly) {
  for (const std::filesystem::path& path : FilesIn("models")) {
    SCOPED_TRACE(path.string());
    source::SourceSet sources;
    source::Diagnostics diagnostics;
    const int file = sources.AddText(path.string(), Read(path));
    std::string lines, plain, comments;
    for (const Token& token : Lex(sources, file, kMaxTokens, diagnostics)) {
      lines += std::string(token.text) + "\n";
      plain += std::string(token.text) + " ";
      comments += std::string(token.text) + " // c\n";
    }
    const std::optional<std::string> from_lines = FormatText(lines);
    ASSERT_TRUE(from_lines.has_value());
    EXPECT_EQ(from_lines, FormatText(plain));
    const std::optional<std::string> commented = FormatText(comments);
    ASSERT_TRUE(commented.has_value());
    EXPECT_EQ(FormatText(*commented), commented);
    for (size_t at = 0; at < from_lines->size();) {
      const size_t end = from_lines->find('\n', at);
      EXPECT_LE(end - at, 100U) << from_lines->substr(at, end - at);
      at = end + 1;
    }
  }
}

TEST(Format, ReadsLinesThatEndWithCarriageReturns) {
  EXPECT_EQ(FormatText("// a\rmodule A: // b\r\rlink l: mass=1\r\n/* c\rd */\r"),
            "// a\nmodule A:  // b\n\nlink l: mass=1\n/* c\nd */\n");
}

TEST(Format, HasBeenAppliedToTheModels) {
  for (const std::filesystem::path& path : FilesIn("models")) {
    const std::string text = Read(path);
    EXPECT_EQ(FormatText(text), text) << "mend with: morphbus format " << path;
  }
}

}  // namespace
}  // namespace morphbus::m3l
