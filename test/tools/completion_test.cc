// What a shell offers, of a small program of our own.

#include "tools/shell/completion.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace morphbus::tools {
namespace {

using Words = std::vector<std::string>;

/// walk FILE.m3l [LOG] --robot ROBOT --view side|top... --json, and `many run|stop` of which `run`
/// is implied.
CommandHelp Program() {
  const OptionHelp model = {{"FILE.m3l"}, "FILE.m3l", 1, false, true, false, "a model"};
  const OptionHelp log = {{"LOG"}, "LOG", 1, false, false, false, "a log"};
  const OptionHelp robot = {{"-r", "--robot"}, "ROBOT", 1, false, false, false, "a robot"};
  const OptionHelp view = {{"--view"}, "side|top", 1 << 29, false, false, true, "views"};
  const OptionHelp why = {{"--why"}, "ROBOT [MODULE]", 2, false, false, false, "explains"};
  const OptionHelp page = {{"--page"}, "FOLDER", 1, true, false, false, "a page"};
  const OptionHelp json = {{"--json"}, "", 0, true, false, false, "as JSON"};
  const CommandHelp walk = {"walk", "walks", "", {model, log, robot, view, why, page, json},
                            {},     ""};
  const CommandHelp run = {"run", "runs", "", {model, json}, {}, ""};
  const CommandHelp stop = {"stop", "stops", "", {}, {}, ""};
  return {"program", "", "", {}, {walk, {"many", "many", "", {}, {run, stop}, "run"}}, ""};
}

/// Names of robots that tell what the line has.
TypeValues Values(const std::string& type, const TypedLine& line) {
  if (type == "MODULE") return {{{"m1", ""}, {"m2", ""}}};
  if (type != "ROBOT") return {};
  return {{{"snake", ""}, {"of_" + std::to_string(line.arguments.size()), ""}}};
}

/// The words that are offered behind `typed`, whose last word may be empty.
Words Offered(const Words& typed) {
  const CommandHelp program = Program();
  const Completion completion = Complete(program, typed, Values);
  Words words;
  for (const Candidate& one : completion.candidates) words.push_back(one.word);
  if (completion.files) words.emplace_back("(files)");
  if (completion.folders) words.emplace_back("(folders)");
  words.insert(words.end(), completion.endings.begin(), completion.endings.end());
  return words;
}

TEST(Completion, OffersCommandsByWhatIsTyped) {
  EXPECT_EQ(Offered({""}), (Words{"walk", "many"}));
  EXPECT_EQ(Offered({"w"}), (Words{"walk"}));
  EXPECT_EQ(Offered({"x"}), Words());
  EXPECT_EQ(Offered({"unknown", ""}), Words());
}

TEST(Completion, OffersCommandsBelowACommandAndWhatTheImpliedOneTakes) {
  EXPECT_EQ(Offered({"many", ""}), (Words{"run", "stop", "(files)", ".m3l"}));
  EXPECT_EQ(Offered({"many", "a.m3l", "--"}), (Words{"--json"}));
  EXPECT_EQ(Offered({"many", "run", ""}), (Words{"(files)", ".m3l"}));
  EXPECT_EQ(Offered({"many", "stop", ""}), Words());
}

TEST(Completion, OffersEachOptionOnceUnlessItMayBeRepeated) {
  EXPECT_EQ(Offered({"walk", "--"}), (Words{"--robot", "--view", "--why", "--page", "--json"}));
  EXPECT_EQ(Offered({"walk", "-r", "snake", "--json", "--view", "top", "--"}),
            (Words{"--view", "--why", "--page"}));
  // Behind "--" there are only arguments.
  EXPECT_EQ(Offered({"walk", "--", "--"}), (Words{"(files)", ".m3l"}));
}

TEST(Completion, OffersArgumentsByTheirPlaces) {
  EXPECT_EQ(Offered({"walk", ""}), (Words{"(files)", ".m3l"}));
  EXPECT_EQ(Offered({"walk", "a.m3l", "--json", ""}),
            (Words{"(files)", ".log", ".log.zst", ".partial"}));
  EXPECT_EQ(Offered({"walk", "a.m3l", "b.log", ""}), Words());
}

TEST(Completion, OffersValuesOfOptions) {
  EXPECT_EQ(Offered({"walk", "a.m3l", "--robot", ""}), (Words{"snake", "of_1"}));
  EXPECT_EQ(Offered({"walk", "-r", "s"}), (Words{"snake"}));
  EXPECT_EQ(Offered({"walk", "--robot=s"}), (Words{"--robot=snake"}));
  EXPECT_EQ(Offered({"walk", "--nothing=s"}), Words());
  // One that takes several may get another, or be over.
  EXPECT_EQ(Offered({"walk", "--view", "s"}), (Words{"side"}));
  EXPECT_EQ(Offered({"walk", "--view", "side", "t"}), (Words{"top", "(files)", ".m3l"}));
  EXPECT_EQ(Offered({"walk", "--why", "snake", "m"}), (Words{"m1", "m2", "(files)", ".m3l"}));
  EXPECT_EQ(Offered({"walk", "--why", "snake", "m1", ""}), (Words{"(files)", ".m3l"}));
  // One that may stand alone may be followed by an option.
  EXPECT_EQ(Offered({"walk", "--page", "--j"}), (Words{"--json", "(folders)"}));
}

}  // namespace
}  // namespace morphbus::tools
