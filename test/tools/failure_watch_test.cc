#include "tools/launch/failure_watch.h"

#include <gtest/gtest.h>

#include <csignal>
#include <optional>

#include "tools/base/messages.h"

namespace morphbus::tools {
namespace {

constexpr int kKilled = 128 + SIGKILL;
constexpr const char* kHow = "was killed by signal 9 (Killed)";

TEST(ExitLimitTest, TheThirdExitWithinTenSecondsIsOneTooMany) {
  ExitLimit limit;
  EXPECT_FALSE(limit.TooMany(5));
  EXPECT_FALSE(limit.TooMany(5));
  EXPECT_TRUE(limit.TooMany(14.9));
}

TEST(ExitLimitTest, WhoDiesNowAndThenMayGoOnForEver) {
  ExitLimit limit;
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(limit.TooMany(5.0 * i)) << i;
  EXPECT_FALSE(limit.TooMany(5000)) << "the last but one was ten seconds ago";
  EXPECT_TRUE(limit.TooMany(5004.9));
}

/// A run as the launcher watches it, on a clock of its own: it looks twenty times a second.
class FailureWatchTest : public ::testing::Test {
 protected:
  static constexpr int64_t kRoundUs = 50'000;

  /// Time goes on; meanwhile the sim reports its progress, if it `speaks`.
  void Pass(double seconds, bool speaks) {
    const int64_t end = time_.NowUs() + static_cast<int64_t>(seconds * 1e6);
    while (time_.NowUs() < end) {
      time_.AdvanceTo(time_.NowUs() + kRoundUs);
      if (speaks) watch_.SimSpoke();
      watch_.OnTime();
    }
  }

  /// Seconds from now until the run has failed; nothing if it has not within a minute.
  std::optional<double> FailsAfter(bool sim_speaks) {
    const int64_t begun = time_.NowUs();
    while (watch_.error().empty()) {
      if (time_.NowUs() - begun > 60'000'000) return std::nullopt;
      Pass(0.05, sim_speaks);
    }
    return static_cast<double>(time_.NowUs() - begun) * 1e-6;
  }

  bridge::VirtualTime time_;
  FailureWatch watch_{&time_};
};

TEST_F(FailureWatchTest, TheThirdExitOfAModuleWithinTenSecondsEndsTheRunInTheSameMoment) {
  EXPECT_TRUE(watch_.OnExit("module m3", kKilled, kHow));
  Pass(4, true);
  EXPECT_TRUE(watch_.OnExit("module m3", kKilled, kHow));
  Pass(5, true);
  EXPECT_TRUE(watch_.OnExit("module m4", kKilled, kHow)) << "each process has its own count";
  EXPECT_EQ(watch_.error(), "");
  EXPECT_FALSE(watch_.OnExit("module m3", kKilled, kHow));
  EXPECT_EQ(watch_.error(),
            "module m3 was killed by signal 9 (Killed), the third exit within 10 s");
  EXPECT_FALSE(watch_.OnExit("module m4", kKilled, kHow)) << "nobody is started for a failed run";
}

TEST_F(FailureWatchTest, ThreeExitsInMoreThanTenSecondsEndNothing) {
  for (int i = 0; i < 20; ++i) {
    EXPECT_TRUE(watch_.OnExit("module m3", kKilled, kHow)) << i;
    Pass(5, true);
  }
  EXPECT_EQ(watch_.error(), "");
}

TEST_F(FailureWatchTest, ADeadSimEndsTheRunInTheSameMoment) {
  Pass(1, true);
  EXPECT_FALSE(watch_.OnExit(FailureWatch::kSim, kKilled, kHow));
  EXPECT_EQ(watch_.error(), "sim was killed by signal 9 (Killed)");
}

TEST_F(FailureWatchTest, ADeadLoggerEndsTheRunInTheSameMoment) {
  Pass(1, true);
  EXPECT_FALSE(watch_.OnExit(FailureWatch::kLog, kKilled, kHow));
  EXPECT_EQ(watch_.error(), "log was killed by signal 9 (Killed)");
}

TEST_F(FailureWatchTest, AModuleThatCannotUseItsInputIsNotStartedAgain) {
  EXPECT_FALSE(watch_.OnExit("module m1", kUnusable, "ended with status 2"));
  EXPECT_EQ(watch_.error(), "module m1 ended with status 2");
}

TEST_F(FailureWatchTest, ASimThatLeavesWithoutAReportEndsTheRunInTwoSeconds) {
  Pass(1, true);
  EXPECT_FALSE(watch_.OnExit(FailureWatch::kSim, 0, "ended"));
  EXPECT_EQ(watch_.error(), "");
  const std::optional<double> after = FailsAfter(false);
  ASSERT_TRUE(after);
  EXPECT_NEAR(*after, FailureWatch::kLeftSeconds, 0.1);
  EXPECT_EQ(watch_.error(), "sim left the run before its end");
}

TEST_F(FailureWatchTest, ALoggerThatSaysWhatWasWrongEndsTheRunInHalfASecond) {
  watch_.LogClosed("the disk is full");
  EXPECT_FALSE(watch_.OnExit(FailureWatch::kLog, 3, "ended with status 3"));
  EXPECT_EQ(watch_.error(), "");
  const std::optional<double> after = FailsAfter(true);
  ASSERT_TRUE(after);
  EXPECT_NEAR(*after, FailureWatch::kToldSeconds, 0.1);
  EXPECT_EQ(watch_.error(), "log left the run before its end: the disk is full");
}

TEST_F(FailureWatchTest, ASilentSimEndsTheRunInEightSecondsAndOneThatSpeaksNever) {
  Pass(60, false);
  EXPECT_EQ(watch_.error(), "") << "it may build its robot for as long as it takes";
  EXPECT_FALSE(FailsAfter(true));
  const std::optional<double> after = FailsAfter(false);
  ASSERT_TRUE(after);
  EXPECT_NEAR(*after, FailureWatch::kSilentSeconds, 0.1);
  EXPECT_EQ(watch_.error(), "sim has been silent for 8 s");
}

TEST_F(FailureWatchTest, TimeInWhichTheLauncherStoodStillCountsForNothing) {
  Pass(1, true);
  time_.AdvanceTo(time_.NowUs() + 3'600'000'000);
  watch_.OnTime();
  EXPECT_EQ(watch_.error(), "");
}

TEST_F(FailureWatchTest, ALauncherThatGoesOnBeforeTheRestOfAStoppedRunBlamesNobody) {
  Pass(1, true);
  watch_.Interrupted();
  EXPECT_FALSE(watch_.OnExit("module m1", 0, "ended"));
  // All are stopped for longer than anybody may be silent, take to report, or to stop; and again.
  for (int i = 0; i < 2; ++i) {
    time_.AdvanceTo(time_.NowUs() + 12'000'000);
    watch_.OnTime();
    // The launcher hears nothing until the others go on, too.
    Pass(0.05, false);
    ASSERT_EQ(watch_.error(), "");
    Pass(0.05, true);
  }
  EXPECT_EQ(watch_.error(), "");
}

TEST_F(FailureWatchTest, ARunThatDoesNotStopWhenToldToEndsInTenSeconds) {
  Pass(1, true);
  watch_.Interrupted();
  const std::optional<double> after = FailsAfter(true);
  ASSERT_TRUE(after);
  EXPECT_NEAR(*after, FailureWatch::kStopSeconds, 0.1);
  EXPECT_EQ(watch_.error(), "the run did not stop when told to");
}

TEST_F(FailureWatchTest, WhatTheSimReportsTakesThePlaceOfWhatWasFoundBefore) {
  EXPECT_FALSE(watch_.OnExit(FailureWatch::kLog, kKilled, kHow));
  watch_.SimReported("m1 does not answer");
  EXPECT_EQ(watch_.error(), "m1 does not answer");
}

TEST_F(FailureWatchTest, AfterTheSimsReportAllMayLeaveAndAnErrorIsNamed) {
  watch_.SimReported("");
  EXPECT_FALSE(watch_.OnExit("module m1", 0, "ended"));
  EXPECT_FALSE(FailsAfter(false));
  EXPECT_FALSE(watch_.OnExit("module m2", kKilled, kHow));
  EXPECT_EQ(watch_.error(), "module m2 was killed by signal 9 (Killed) at the end of the run");
}

}  // namespace
}  // namespace morphbus::tools
