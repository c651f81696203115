#include "tools/launch/run_outcome.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

namespace morphbus::tools {
namespace {

logger::FaultFact SomeFault() {
  logger::FaultFact fault;
  fault.time_us = 3'200'000;
  fault.module = "m2";
  fault.role = "Head";
  fault.text = "division by zero";
  fault.function = "Head.behave";
  fault.file = "walk.dyn";
  fault.fault.line = 12;
  return fault;
}

TEST(FaultTest, APlaceInTheSourceIsNamedAsInDiagnostics) {
  const Json json = FaultJson(SomeFault());
  EXPECT_EQ(json["line"], 12);
  EXPECT_EQ(FaultText(SomeFault()),
            "    3.20 s  m2     walk.dyn:12: division by zero (in Head.behave)");
}

TEST(FaultTest, WithoutAPlaceNoneIsMadeUp) {
  logger::FaultFact fault = SomeFault();
  fault.fault.line = 0;
  fault.function.clear();
  const Json json = FaultJson(fault);
  for (const char* key : {"file", "line", "function"}) EXPECT_TRUE(json[key].is_null()) << key;
  EXPECT_EQ(FaultText(fault), "    3.20 s  m2     division by zero");
}

/// A run of 60 modules of which 45 had a role, with all that may be told of each.
RunSummary LargeRun() {
  RunSummary s;
  s.outcome.run = "large";
  s.outcome.log = "large.log";
  s.facts.seconds = 1.5;
  s.lost = 600;
  for (int i = 1; i <= 60; ++i) {
    const std::string name = "m" + std::to_string(i);
    s.roles.emplace_back(name, i <= 45 ? "Rocker" : "");
    if (i > 45) s.problems.push_back(name + ": has no role when the run ends");
    s.facts.health[name].lost = 10;
    s.facts.lateness[name].missed = 1;
    s.outcome.restarts[name] = 1;
  }
  return s;
}

std::vector<std::string> LinesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

TEST(SummaryTest, AFailedRunOfManyModulesSaysFirstWhyAndFitsAScreen) {
  RunSummary s = LargeRun();
  s.outcome.error = s.outcome.reason = "m30, m31, m32 and 4 more do not answer";
  const std::vector<std::string> lines = LinesOf(SummaryText(s));
  EXPECT_EQ(lines[0], "failed at 1.50 s: m30, m31, m32 and 4 more do not answer");
  EXPECT_EQ(std::count(lines.begin(), lines.end(),
                       "  15 of 60 modules have no role: m46, m47, m48 and 12 more"),
            1);
  EXPECT_LE(lines.size(), 45u);
  for (const std::string& line : lines) {
    EXPECT_LE(line.size(), 100u) << line;
    // What a module lacks for a role need not be the program's fault, and the reason stands above.
    EXPECT_EQ(line.find("problem:"), std::string::npos) << line;
    EXPECT_EQ(line.find("ended:"), std::string::npos) << line;
  }
}

TEST(SummaryTest, OneThatEndedWellTellsOfEveryModulesRoleAndOfTenProblems) {
  RunSummary s = LargeRun();
  s.outcome.reason = "finished";
  const std::vector<std::string> lines = LinesOf(SummaryText(s));
  EXPECT_TRUE(lines[0].starts_with("run large: ")) << lines[0];
  const auto count = [&](const std::string& word) {
    return std::count_if(lines.begin(), lines.end(), [&](const std::string& line) {
      return line.find(word) != std::string::npos;
    });
  };
  EXPECT_EQ(count("Rocker"), 45);
  EXPECT_EQ(count("problem: "), 10);
  EXPECT_EQ(count("and 5 more (--json)"), 1);
  EXPECT_EQ(count("ended: finished"), 1);
  // Losses, lateness and restarts: the first ten of each.
  EXPECT_EQ(count("thrown away"), 10);
  EXPECT_EQ(count("and 50 more (--json)"), 3);
}

}  // namespace
}  // namespace morphbus::tools
