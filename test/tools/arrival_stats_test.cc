#include "tools/spy/arrival_stats.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace morphbus::tools {
namespace {

constexpr int64_t kWholeSecond = 1'000'000'000;
constexpr int64_t kMillisecond = 1'000'000;

TEST(ArrivalStatsTest, ARateIsThatOfWholeIntervals) {
  ArrivalStats stats;
  // 1 Hz: however the second in which one looks lies, it is 1 Hz.
  for (int i = 0; i < 5; ++i) stats.Take(i * kWholeSecond, 100);
  for (const int64_t look : {0, 300, 900, 1500}) {
    EXPECT_NEAR(stats.At(4 * kWholeSecond + look * kMillisecond).hz, 1.0, 1e-6) << look;
  }
  EXPECT_NEAR(stats.At(4 * kWholeSecond).bytes_per_s, 100.0, 1e-3);
}

TEST(ArrivalStatsTest, ARateFollowsAChangeWithinTwoSeconds) {
  ArrivalStats stats;
  for (int i = 0; i <= 100; ++i) stats.Take(i * 10 * kMillisecond, 1);
  EXPECT_NEAR(stats.At(1 * kWholeSecond).hz, 100.0, 0.01);
  for (int i = 1; i <= 40; ++i) stats.Take(kWholeSecond + i * 50 * kMillisecond, 1);
  EXPECT_NEAR(stats.At(3 * kWholeSecond).hz, 20.0, 0.01);
}

TEST(ArrivalStatsTest, ASilentChannelHasTheRateZeroAndKeepsItsJitter) {
  ArrivalStats stats;
  for (int i = 0; i <= 100; ++i) stats.Take(i * 20 * kMillisecond + (i % 4) * kMillisecond, 1);
  EXPECT_GT(stats.At(2900 * kMillisecond).hz, 0.0);
  const ArrivalFigures silent = stats.At(3100 * kMillisecond);
  EXPECT_EQ(silent.hz, 0.0);
  EXPECT_EQ(silent.bytes_per_s, 0.0);
  EXPECT_NEAR(silent.silent_s, 1.1, 1e-6);
  EXPECT_NEAR(silent.jitter_p99_s, 0.004, 1e-8);
}

TEST(ArrivalStatsTest, PercentilesAreThoseOfASortedList) {
  ArrivalStats stats;
  std::mt19937 random(7);
  std::vector<double> intervals;
  int64_t at = kWholeSecond;
  stats.Take(at, 1);
  for (int i = 0; i < ArrivalStats::kMost; ++i) {
    const auto interval = static_cast<int64_t>(20 * kMillisecond + random() % 1'000'000);
    at += interval;
    stats.Take(at, 1);
    intervals.push_back(static_cast<double>(interval) * 1e-9);
  }
  // The other way: sort everything and take the places.
  std::sort(intervals.begin(), intervals.end());
  const double median = intervals[intervals.size() / 2 - 1];
  std::vector<double> deviations;
  for (const double interval : intervals) deviations.push_back(std::fabs(interval - median));
  std::sort(deviations.begin(), deviations.end());
  const ArrivalFigures figures = stats.At(at);
  EXPECT_EQ(figures.intervals, ArrivalStats::kMost);
  EXPECT_NEAR(figures.period_s, median, 1e-8);
  EXPECT_NEAR(figures.jitter_p50_s, deviations[511], 1e-8);
  EXPECT_NEAR(figures.jitter_p99_s, deviations[1013], 1e-8);
}

TEST(ArrivalStatsTest, OnlyTheLastIntervalsCount) {
  ArrivalStats stats;
  int64_t at = 0;
  for (int i = 0; i < 3000; ++i) stats.Take(at += 500 * kMillisecond, 1);
  for (int i = 0; i < ArrivalStats::kMost + 1; ++i) stats.Take(at += 10 * kMillisecond, 1);
  const ArrivalFigures figures = stats.At(at);
  EXPECT_NEAR(figures.period_s, 0.01, 1e-8);
  EXPECT_EQ(figures.jitter_p99_s, 0.0);
  EXPECT_NEAR(figures.hz, 100.0, 0.01);
}

TEST(ArrivalStatsTest, AClockThatIsSetBackCostsOneInterval) {
  ArrivalStats stats;
  stats.Take(10 * kWholeSecond, 1);
  stats.Take(11 * kWholeSecond, 1);
  stats.Take(2 * kWholeSecond, 1);
  stats.Take(3 * kWholeSecond, 1);
  const ArrivalFigures figures = stats.At(kWholeSecond);
  EXPECT_EQ(figures.intervals, 2);
  EXPECT_NEAR(figures.hz, 1.0, 1e-6);
  EXPECT_EQ(figures.silent_s, 0.0);
}

TEST(ArrivalStatsTest, TheHistoryIsTheRateSecondBySecond) {
  ArrivalStats stats;
  // Two seconds at 10 Hz, two at 100 Hz, then silence: a rate is that of the last two seconds.
  for (int i = 0; i <= 20; ++i) stats.Take(i * 100 * kMillisecond, 1);
  for (int i = 1; i <= 200; ++i) stats.Take(2 * kWholeSecond + i * 10 * kMillisecond, 1);
  const std::vector<double> history = stats.At(9 * kWholeSecond + 500 * kMillisecond).hz_history;
  ASSERT_EQ(history.size(), 9u);
  EXPECT_NEAR(history[0], 10.0, 0.01);
  EXPECT_NEAR(history[1], 10.0, 0.01);
  EXPECT_NEAR(history[3], 100.0, 5.0);
  // It is 0 as soon as HZ is.
  EXPECT_NEAR(history[4], 100.0, 5.0);
  EXPECT_EQ(history[5], 0.0);
  EXPECT_EQ(history[8], 0.0);
  // What comes then is no part of what was before.
  stats.Take(10 * kWholeSecond, 1);
  EXPECT_EQ(stats.At(10 * kWholeSecond).hz_history.size(), 10u);
}

TEST(ArrivalStatsTest, TheHistoryIsThatOfTheLastMinute) {
  ArrivalStats stats;
  for (int i = 0; i < 500; ++i) stats.Take(i * kWholeSecond, 1);
  EXPECT_EQ(stats.At(500 * kWholeSecond).hz_history.size(),
            static_cast<size_t>(ArrivalStats::kMostRates));
  EXPECT_NEAR(stats.At(500 * kWholeSecond).hz_history.front(), 1.0, 1e-6);
  // After a year of silence there is a minute of it, at no cost.
  const std::vector<double> silence = stats.At(31'000'000 * kWholeSecond).hz_history;
  EXPECT_EQ(silence, std::vector<double>(ArrivalStats::kMostRates, 0.0));
  // A clock that is set back begins a new minute, and does not wait for the old one.
  stats.Take(10 * kWholeSecond, 1);
  stats.Take(11 * kWholeSecond + 1, 1);
  EXPECT_EQ(stats.At(12 * kWholeSecond + 1).hz_history.size(),
            static_cast<size_t>(ArrivalStats::kMostRates));
}

TEST(ArrivalStatsTest, WithoutIntervalsThereAreNoFigures) {
  ArrivalStats stats;
  EXPECT_EQ(stats.At(kWholeSecond).hz, 0.0);
  stats.Take(0, 1);
  EXPECT_EQ(stats.At(kWholeSecond).intervals, 0);
  EXPECT_EQ(stats.At(kWholeSecond).hz, 0.0);
  // Two at the same time make no rate, and no division by zero.
  stats.Take(0, 1);
  EXPECT_EQ(stats.At(0).hz, 0.0);
}

}  // namespace
}  // namespace morphbus::tools
