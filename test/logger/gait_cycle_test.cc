#include "logger/figures/gait_cycle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

namespace morphbus::logger {
namespace {

constexpr double kTick = 0.02;
constexpr double kOneDegree = std::numbers::pi / 180.0;
constexpr double kTurn = 2.0 * std::numbers::pi;

/// What a joint is told at each time (s).
using Law = std::function<double(double)>;

/// The signals of joints that follow these laws at every tick.
std::vector<Signal> Sampled(const std::vector<Law>& laws, double seconds) {
  std::vector<Signal> signals;
  for (const Law& law : laws) {
    Signal signal{{}, kOneDegree};
    for (int k = 0; k * kTick < seconds; ++k) signal.values.push_back(law(k * kTick));
    signals.push_back(std::move(signal));
  }
  return signals;
}

/// A wave of 40 degrees; `phase` in turns.
Law Wave(double period, double phase = 0.0, double degrees = 40.0) {
  return [=](double t) { return degrees * kOneDegree * std::sin(kTurn * (t / period + phase)); };
}

/// One of several positions (degrees) after another, each for an equal part of the period; none is
/// taken before its time, so that with ticks the parts are of unlike length.
Law Steps(double period, std::vector<double> degrees, double phase = 0.0) {
  return [=](double t) {
    const double at = std::fmod(t / period + phase + 1e-9, 1.0);
    return degrees[static_cast<size_t>(at * static_cast<double>(degrees.size()))] * kOneDegree;
  };
}

Law Sum(const Law& a, const Law& b) {
  return [=](double t) { return a(t) + b(t); };
}

/// `law` from `begin` to `end` (s); before and after it the joint is where it is then.
Law Between(const Law& law, double begin, double end) {
  return [=](double t) { return law(std::clamp(t, begin, end)); };
}

/// Seconds of the cycle; fails if there is none.
double PeriodOf(const std::vector<Law>& laws, double seconds, int slack_ticks = 2) {
  const CycleSearch found = FindCycle(Sampled(laws, seconds), {kTick, slack_ticks});
  EXPECT_TRUE(found.cycle.has_value()) << found.why_not;
  return found.cycle ? found.cycle->period * kTick : 0.0;
}

std::string WhyNone(const std::vector<Law>& laws, double seconds) {
  const CycleSearch found = FindCycle(Sampled(laws, seconds), {kTick, 2});
  EXPECT_FALSE(found.cycle.has_value()) << found.cycle->period * kTick << " s";
  return found.why_not;
}

class WavesTest : public testing::TestWithParam<double> {};

TEST_P(WavesTest, ThePeriodOfAWaveIsFoundToOnePerCent) {
  const double period = GetParam();
  // A worm: each joint is a quarter of a turn behind the one before it.
  std::vector<Law> worm;
  for (int i = 0; i < 4; ++i) worm.push_back(Wave(period, 0.25 * i));
  for (const double seconds : {15.0, 40.0}) {
    EXPECT_NEAR(PeriodOf(worm, seconds), period, 0.01 * period) << seconds;
  }
  // The tolerances that a run in real time has.
  EXPECT_NEAR(PeriodOf(worm, 15.0, 7), period, 0.01 * period);
}

TEST_P(WavesTest, AngleRoundedToWholeDegreesHasTheSamePeriod) {
  const Law wave = Wave(GetParam(), 0.0, 20.0);
  const Law rounded = [=](double t) { return std::round(wave(t) / kOneDegree) * kOneDegree; };
  EXPECT_NEAR(PeriodOf({rounded}, 15.0), GetParam(), 0.01 * GetParam());
}

TEST_P(WavesTest, WhatHappensBeforeAndAnUnfinishedLastCycleDoNoHarm) {
  const double period = GetParam();
  // Standing up: a jump and a ramp before the wave, which ends within a cycle.
  const Law wave = Wave(period);
  const Law gait = [=](double t) {
    if (t < 0.5) return 0.0;
    return t < 2.0 ? 70.0 * kOneDegree - 20.0 * kOneDegree * t : wave(t);
  };
  const CycleSearch found = FindCycle(Sampled({gait, Steps(1e6, {30})}, 2.0 + 3.7 * period), {});
  ASSERT_TRUE(found.cycle) << found.why_not;
  EXPECT_NEAR(found.cycle->period * kTick, period, 0.01 * period);
  // A part of what came before may look like a part of a cycle.
  EXPECT_GE(found.cycle->begins.front() * kTick, 2.0 - 0.5 * period);
  EXPECT_GE(found.cycle->begins.size(), 3u);
}

INSTANTIATE_TEST_SUITE_P(Seconds, WavesTest, testing::Values(0.37, 0.5, 0.73, 1.1, 2.0, 2.9, 4.1));

TEST(FindCycle, StepsHaveThePeriodAfterWhichAllJointsRepeat) {
  // A leg goes up, waits, comes down and waits for the other three: as the quadruped's.
  std::vector<Law> legs;
  for (int leg = 0; leg < 4; ++leg) {
    legs.push_back(Steps(7.04, {45, 0, 0, 0, 0, 0, 0, 0}, 0.25 * leg));
    legs.push_back(Steps(7.04, {0, -45, -45, -45, 0, 0, 0, 0}, 0.25 * leg));
  }
  EXPECT_NEAR(PeriodOf(legs, 20.0), 7.04, 1e-9);
  EXPECT_NEAR(PeriodOf(legs, 60.0), 7.04, 1e-9);
}

TEST(FindCycle, StepsOfUnevenLengthHaveThePeriodOfWhatMadeThem) {
  // 18.5 ticks, and 36.65: no two cycles have their steps at the same ticks.
  EXPECT_NEAR(PeriodOf({Steps(0.37, {0, 30})}, 15.0), 0.37, 0.0037);
  EXPECT_NEAR(PeriodOf({Steps(0.733, {0, 30, 10}), Steps(0.733, {5, 5, 40})}, 15.0), 0.733,
              0.00733);
}

TEST(FindCycle, OfTwoFrequenciesThePeriodIsTheCommonOne) {
  for (const double period : {0.74, 2.0, 3.1}) {
    // In two joints, and in one.
    EXPECT_NEAR(PeriodOf({Wave(period), Wave(period / 2)}, 15.0), period, 0.01 * period);
    EXPECT_NEAR(PeriodOf({Sum(Wave(period), Wave(period / 2))}, 15.0), period, 0.01 * period);
    EXPECT_NEAR(PeriodOf({Wave(period / 2), Wave(period / 3)}, 15.0), period, 0.01 * period);
    EXPECT_NEAR(PeriodOf({Sum(Wave(period / 2), Wave(period / 3))}, 15.0), period, 0.01 * period);
  }
  // The slow one may be small.
  EXPECT_NEAR(PeriodOf({Sum(Wave(2.0, 0.1, 8.0), Wave(1.0))}, 15.0), 2.0, 0.02);
}

TEST(FindCycle, WhichJointMovesMostMakesNoDifference) {
  EXPECT_NEAR(PeriodOf({Wave(1.0, 0, 80), Wave(2.0, 0, 10)}, 15.0), 2.0, 0.02);
  EXPECT_NEAR(PeriodOf({Wave(2.0, 0, 10), Wave(1.0, 0, 80)}, 15.0), 2.0, 0.02);
}

TEST(FindCycle, EachCycleBeginsWhereTheFirstOneComesAgain) {
  const CycleSearch found = FindCycle(Sampled({Steps(2.0, {0, 30, 10}, 0.5)}, 11.0), {});
  ASSERT_TRUE(found.cycle) << found.why_not;
  for (size_t i = 0; i < found.cycle->begins.size(); ++i) {
    EXPECT_NEAR(found.cycle->begins[i] - found.cycle->begins[0], 100.0 * static_cast<double>(i),
                1e-9);
  }
  // From the first change on, at 0.34 s, to the end: 5 whole ones.
  EXPECT_EQ(found.cycle->begins.size(), 6u);
}

TEST(FindCycle, ACycleThatTakesLongerNowAndThenIsFollowed) {
  // Every third cycle waits for something for two ticks.
  const Law gait = [](double t) {
    const int tick = static_cast<int>(std::lround(t / kTick)) % 302;
    return (tick % 100 < 50 && tick < 300 ? 30.0 : -30.0) * kOneDegree;
  };
  const CycleSearch found = FindCycle(Sampled({gait}, 30.0), {});
  ASSERT_TRUE(found.cycle) << found.why_not;
  EXPECT_NEAR(found.cycle->period, 302.0 / 3.0, 1.0);
  for (size_t i = 1; i < found.cycle->begins.size(); ++i) {
    const double length = found.cycle->begins[i] - found.cycle->begins[i - 1];
    EXPECT_GE(length, 99.0);
    EXPECT_LE(length, 103.0);
  }
}

TEST(FindCycle, ACycleAsShortAsTheSlackComesToAnEnd) {
  // A controller at its limits says one thing at one tick and the opposite at the next one.
  for (const int ticks : {2, 3, 4}) {
    const Law toggle = [ticks](double t) {
      const int tick = static_cast<int>(std::lround(t / kTick));
      return (tick % ticks == 0 ? 20.0 : -20.0) * kOneDegree;
    };
    EXPECT_NEAR(PeriodOf({toggle}, 1.0), ticks * kTick, 0.01 * kTick) << ticks;
  }
}

TEST(FindCycle, WhatLastsNotQuiteTwoCyclesIsReadToItsEndAndNoFurther) {
  // Early by the slack two cycles would fit, but the period that is then refined is a longer one;
  // the sanitized build sees what lies behind the end.
  for (const double seconds : {8.1, 8.14, 8.16}) {
    EXPECT_EQ(WhyNone({Wave(4.1)}, seconds), "the commands do not repeat for two whole cycles");
  }
}

TEST(FindCycle, AGaitThatHaltsHasItsCycleAllTheSame) {
  EXPECT_NEAR(PeriodOf({Between(Wave(2.0), 1.0, 13.3)}, 20.0), 2.0, 0.02);
}

TEST(FindCycle, AnHourIsSearchedToo) {
  EXPECT_NEAR(PeriodOf({Between(Wave(2.9), 100.0, 3000.0)}, 3600.0), 2.9, 0.029);
  const CycleSearch found = FindCycle(Sampled({Wave(2.9)}, 3600.0), {});
  ASSERT_TRUE(found.cycle);
  EXPECT_NEAR(static_cast<double>(found.cycle->begins.size()), 3600 / 2.9, 2.0);
}

TEST(FindCycle, WhereThereIsNoneItSaysWhy) {
  EXPECT_EQ(FindCycle({}, {}).why_not, "there are no commands");
  EXPECT_EQ(WhyNone({Steps(100, {3})}, 15.0), "the commands do not change");
  // Less than a degree to and fro is nobody's gait.
  EXPECT_EQ(WhyNone({Wave(1.0, 0, 0.7)}, 15.0), "the commands do not change");
  EXPECT_EQ(WhyNone({Wave(9.0)}, 15.0), "the commands do not repeat for two whole cycles");
  // A wheel that turns on once told to.
  EXPECT_EQ(WhyNone({[](double t) { return t < 0.49 ? 0.0 : 2.0; }}, 15.0),
            "the commands change for the last time at 0.50 s");
  EXPECT_EQ(WhyNone({Between(Wave(40.0), 1.0, 9.0)}, 15.0),
            "the commands do not repeat for two whole cycles");
  EXPECT_EQ(WhyNone({Steps(0.1, {3, 20})}, 0.1), "the run is too short");
  // Two periods without a common one.
  EXPECT_EQ(WhyNone({Wave(2.0), Wave(2.0 * std::numbers::sqrt2)}, 15.0),
            "the commands do not repeat for two whole cycles");
  // Two waves of the hand in a long dance.
  std::mt19937 random(3);
  std::vector<double> dance;
  for (int i = 0; i < 200; ++i) dance.push_back(static_cast<double>(random() % 90));
  const Law wave = Wave(1.0), dancing = Steps(20.0, dance);
  const std::string why =
      WhyNone({[=](double t) { return t > 9.0 && t < 11.5 ? wave(t) : dancing(t); }}, 20.0);
  EXPECT_EQ(why.rfind("the commands repeat for ", 0), 0u) << why;
}

TEST(FindCycle, NoiseHasNoCycle) {
  std::mt19937 random(7);
  std::vector<double> values;
  for (int i = 0; i < 750; ++i) values.push_back(static_cast<double>(random() % 60) - 30.0);
  WhyNone({Steps(15.0, values)}, 15.0);
  // A wave is found through noise of two degrees all the same.
  const Law noise = Steps(15.0, values), wave = Wave(1.1);
  EXPECT_NEAR(PeriodOf({[=](double t) { return wave(t) + noise(t) / 15.0; }}, 15.0), 1.1, 0.011);
}

TEST(Mismatch, TellsWhatRepeatsFromWhatDoesNot) {
  const std::vector<Signal> signals = Sampled({Wave(1.1), Wave(1.1, 0.3)}, 15.0);
  EXPECT_LT(*Mismatch(signals, 55.0, 0, 700, 2), 1e-3);
  EXPECT_GT(*Mismatch(signals, 80.0, 0, 700, 2), 0.5);
  EXPECT_FALSE(Mismatch(Sampled({Steps(9, {1})}, 15.0), 55.0, 0, 700, 2).has_value());
}

}  // namespace
}  // namespace morphbus::logger
