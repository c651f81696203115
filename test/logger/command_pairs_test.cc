#include "logger/compare/command_pairs.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace morphbus::logger {
namespace {

LogFacts WithCommands(const std::vector<std::pair<int64_t, std::string>>& commands) {
  LogFacts facts;
  for (const auto& [tick, text] : commands) facts.commands.emplace(tick, text);
  return facts;
}

/// "5/5 pause, -/7 stop": ticks in A and B.
std::string Told(const std::vector<CommandPair>& pairs) {
  const auto tick = [](const std::optional<int64_t>& t) { return t ? std::to_string(*t) : "-"; };
  std::string told;
  for (const CommandPair& pair : pairs) {
    told +=
        (told.empty() ? "" : ", ") + tick(pair.tick_a) + "/" + tick(pair.tick_b) + " " + pair.text;
  }
  return told;
}

TEST(CommandPairsTest, TheSameCommandsDifferNowhere) {
  const LogFacts log = WithCommands({{5, "pause"}, {5, "push m5 EAST 2"}, {6, "resume"}});
  const std::vector<CommandPair> pairs = PairCommands(log, log);
  EXPECT_EQ(Told(pairs), "5/5 pause, 5/5 push m5 EAST 2, 6/6 resume");
  EXPECT_EQ(CommandsNote(pairs, true), "");
  EXPECT_TRUE(PairCommands({}, {}).empty());
}

TEST(CommandPairsTest, WhatOnlyOneRunHadStandsAloneAndIsNoted) {
  const std::vector<CommandPair> pairs =
      PairCommands(WithCommands({{5, "pause"}, {9, "resume"}, {30, "stop"}}),
                   WithCommands({{5, "pause"}, {7, "kill m2"}, {9, "resume"}, {12, "lose m3"}}));
  EXPECT_EQ(Told(pairs), "5/5 pause, -/7 kill m2, 9/9 resume, -/12 lose m3, 30/- stop");
  EXPECT_EQ(CommandsNote(pairs, true),
            "people gave them different commands: 'kill m2' at tick 7 only in B, and 2 more");
  EXPECT_EQ(CommandsNote(PairCommands(WithCommands({{30, "stop"}}), {}), false),
            "people gave them different commands: 'stop' at tick 30 only in A");
}

TEST(CommandPairsTest, AnotherTickIsADifferenceOnlyWhereRunsAreComparedTickForTick) {
  const std::vector<CommandPair> pairs =
      PairCommands(WithCommands({{5, "push m5 UP 1"}}), WithCommands({{8, "push m5 UP 1"}}));
  EXPECT_EQ(Told(pairs), "5/8 push m5 UP 1");
  EXPECT_EQ(CommandsNote(pairs, true),
            "people gave them different commands: 'push m5 UP 1' at tick 5 in A and 8 in B");
  EXPECT_EQ(CommandsNote(pairs, false), "");
}

TEST(CommandPairsTest, EqualTicksArePairedBeforeEqualTexts) {
  // Paired from the front, the first one of B would take the first one of A, and all were wrong.
  const std::vector<CommandPair> pairs =
      PairCommands(WithCommands({{5, "speed 4"}, {8, "speed 4"}, {9, "speed 4"}}),
                   WithCommands({{8, "speed 4"}, {9, "speed 4"}}));
  EXPECT_EQ(Told(pairs), "5/- speed 4, 8/8 speed 4, 9/9 speed 4");
}

TEST(CommandPairsTest, AFloodOfCommandsIsCutAndNotCompared) {
  std::vector<std::pair<int64_t, std::string>> flood;
  for (int64_t i = 0; i < 3 * static_cast<int64_t>(kMostPairedCommands); ++i) {
    flood.emplace_back(i, "speed 1");
  }
  EXPECT_EQ(PairCommands(WithCommands(flood), WithCommands(flood)).size(), kMostPairedCommands);
}

}  // namespace
}  // namespace morphbus::logger
