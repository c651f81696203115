// Two logs that are compared a stretch at a time come to the same as two logs in memory.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "logger/compare/comparer.h"
#include "logger/log/series_reader.h"
#include "test/logger/temp_log.h"

namespace morphbus::logger {
namespace {

using test::SyntheticOptions;

/// Longer than two stretches of 1000 ticks.
SyntheticOptions LongRun() {
  SyntheticOptions options;
  options.ticks = 2300;
  return options;
}

/// The comparison as JSON, sums rounded to what the order of adding leaves.
nlohmann::json Rounded(const Comparison& comparison) {
  nlohmann::json json = ComparisonJson(comparison);
  const auto round = [](nlohmann::json* figures) {
    (*figures)["rms"] = std::round((*figures)["rms"].get<double>() * 1e9) * 1e-9;
  };
  for (nlohmann::json& item : json["items"]) round(&item);
  for (auto& [name, role] : json["roles"].items()) {
    for (auto& [quantity, figures] : role["quantities"].items()) round(&figures);
  }
  return json;
}

void ExpectTheSame(const SyntheticOptions& a, const SyntheticOptions& b, const char* verdict) {
  const TempLog log_a(a);
  const TempLog log_b(b);
  const Result<RunLog> loaded_a = LoadRunLog(log_a.path());
  const Result<RunLog> loaded_b = LoadRunLog(log_b.path());
  const Result<Comparison> sliced = CompareFiles(log_a.path(), log_b.path());
  ASSERT_TRUE(loaded_a && loaded_b && sliced);
  const nlohmann::json whole = Rounded(Compare(*loaded_a, *loaded_b));
  EXPECT_EQ(whole["verdict"], verdict);
  EXPECT_EQ(Rounded(*sliced), whole);
}

TEST(SlicesTest, EqualRunsAreEquivalentEitherWay) {
  ExpectTheSame(LongRun(), LongRun(), "equivalent");
}

TEST(SlicesTest, ADifferenceInALaterStretchIsFoundAtItsTime) {
  SyntheticOptions other = LongRun();
  other.on_sensors = [](sensors_t* sensors) {
    if (sensors->header.tick == 2100) sensors->modules[0].joint_position_si[0] += 0.1;
  };
  ExpectTheSame(LongRun(), other, "different");
}

TEST(SlicesTest, WhatIsLackingInSeveralStretchesIsOneGap) {
  SyntheticOptions other = LongRun();
  other.on_transform = [](const std::string& module, transform_t* transform) {
    const int64_t tick = transform->header.tick;
    if (module == "m2" && (tick == 500 || tick == 1500)) transform->has_pose = 0;
  };
  ExpectTheSame(LongRun(), other, "unusable");
}

TEST(SlicesTest, TheCongruentRobotIsMatchedAlike) {
  SyntheticOptions other = LongRun();
  other.robot = "two";
  ExpectTheSame(LongRun(), other, "equivalent");
}

TEST(SlicesTest, AnOutlineSaysOfItsLogWhatTheWholeLogSays) {
  const TempLog file(LongRun());
  const Result<RunLog> whole = LoadRunLog(file.path());
  const Result<RunLog> outline = LoadRunLog(file.path(), {"", false, true});
  ASSERT_TRUE(whole && outline);
  EXPECT_EQ(FactsJson(whole->facts), FactsJson(outline->facts));
  ASSERT_EQ(whole->modules.size(), outline->modules.size());
  for (size_t m = 0; m < whole->modules.size(); ++m) {
    EXPECT_EQ(whole->modules[m].status.size(), outline->modules[m].status.size());
    EXPECT_LT(outline->modules[m].transforms.size(), 10u);
    EXPECT_TRUE(outline->modules[m].sensors.empty());
  }
}

TEST(SlicesTest, AReaderGivesTheSamplesOfEachStretch) {
  const TempLog file(LongRun());
  const Result<RunLog> whole = LoadRunLog(file.path());
  Result<RunLog> outline = LoadRunLog(file.path(), {"", false, true});
  ASSERT_TRUE(whole && outline);
  auto reader = SeriesReader::Open(&*outline);
  ASSERT_TRUE(reader);
  size_t seen = 0;
  for (int64_t end = 7'000'000; seen < whole->world.size(); end += 7'000'000) {
    (*reader)->ReadUntil(end);
    (*reader)->Install(end);
    ASSERT_FALSE(outline->world.empty());
    for (size_t m = 0; m < whole->modules.size(); ++m) {
      const auto& all = whole->modules[m].transforms;
      const auto& some = outline->modules[m].transforms;
      ASSERT_EQ(some.size(), outline->world.size());
      for (size_t i = 0; i < some.size(); ++i) {
        EXPECT_EQ(some[i].time_us, all[seen + i].time_us);
        EXPECT_EQ(some[i].role, all[seen + i].role);
        EXPECT_EQ(some[i].has_pose, all[seen + i].has_pose);
        ASSERT_EQ(some[i].X_RL.size(), all[seen + i].X_RL.size());
        for (size_t l = 0; l < some[i].X_RL.size(); ++l) {
          EXPECT_EQ(some[i].X_RL[l].position_m[0], all[seen + i].X_RL[l].position_m[0]);
          EXPECT_EQ(some[i].X_RL[l].orientation_wxyz[3], all[seen + i].X_RL[l].orientation_wxyz[3]);
        }
      }
      EXPECT_EQ(outline->modules[m].sensors.size(), outline->world.size());
      EXPECT_EQ(outline->modules[m].actuators.size(), outline->world.size());
    }
    seen += outline->world.size();
  }
  EXPECT_EQ(seen, whole->world.size());
}

}  // namespace
}  // namespace morphbus::logger
