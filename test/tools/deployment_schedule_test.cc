#include "tools/control/deployment_schedule.h"

#include <gtest/gtest.h>

namespace morphbus::tools {
namespace {

using Order = DeploymentSchedule::Order;
using Times = DeploymentSchedule::Times;

/// A run of a minute, with ticks of 20 ms.
constexpr DeploymentSchedule::Run kMinute = {20'000, 3000, false, 0};
/// Bytes of an image whose package is ten pieces long.
constexpr size_t kTenPieces = 10 * 128 - vm::kPackageHeadBytes;

/// The tick at which all go over, less that of the command.
int64_t TicksUntil(const DeploymentSchedule::Run& run, int hops) {
  const Order order = {100, std::nullopt, kTenPieces, hops, true};
  return DeploymentSchedule(run).Plan(order).switch_tick - order.tick;
}

TEST(DeploymentScheduleTest, WithoutATimeAllGoOverWhenTheFurthestHasIt) {
  // Ten pieces, one a tick, and five ticks to spare.
  EXPECT_EQ(TicksUntil(kMinute, 0), 15);
  EXPECT_EQ(TicksUntil(kMinute, 3), 15 + vm::SpreadTicks(1280, 3));
}

TEST(DeploymentScheduleTest, RealTimeAndLossTakeLonger) {
  DeploymentSchedule::Run run = kMinute;
  run.realtime = true;
  const int64_t late = TicksUntil(run, 3);
  EXPECT_GT(late, TicksUntil(kMinute, 3));
  run.loss = 0.2;
  EXPECT_GT(TicksUntil(run, 3), 2 * late);
}

TEST(DeploymentScheduleTest, ATimeIsTheFirstTickThatIsNotBeforeIt) {
  const DeploymentSchedule schedule(kMinute);
  EXPECT_EQ(schedule.Plan({100, 8.0, kTenPieces, 3, true}).switch_tick, 400);
  EXPECT_EQ(schedule.Plan({100, 8.001, kTenPieces, 3, true}).switch_tick, 401);
  EXPECT_EQ(schedule.Plan({100, 8.0, kTenPieces, 3, true}).from_tick, 100);
  EXPECT_EQ(schedule.SecondsOf(401), 8.02);
}

TEST(DeploymentScheduleTest, TimesThatCannotBeKeptAreRefused) {
  const DeploymentSchedule schedule(kMinute);
  const auto why = [&](double at, bool endless) {
    return schedule.WhyNot({100, at, kTenPieces, 3, true}, endless);
  };
  EXPECT_EQ(why(1.98, false),
            "--at 1.98: the run is at 2 s already; name a later time, or leave --at out");
  EXPECT_EQ(why(2, false), "");
  EXPECT_EQ(why(59.98, false), "");
  EXPECT_EQ(why(60, false), "--at 60: the run ends at 60 s");
  EXPECT_EQ(why(60, true), "");
  EXPECT_EQ(why(3602, true), "");
  EXPECT_EQ(why(3603, true), "--at 3603: more than 3600 s ahead of the run, which is at 2 s");
  EXPECT_EQ(schedule.WhyNot({100, std::nullopt, kTenPieces, 3, true}, false), "");
}

TEST(DeploymentScheduleTest, AProgramThatWouldOvertakeOneThatWaitsGoesOutBehindIt) {
  DeploymentSchedule schedule(kMinute);
  const Order first = {100, 10.0, kTenPieces, 3, true};
  EXPECT_EQ(schedule.Begin(first, schedule.Plan(first)).number, 2u);
  // Long before the first one's tick, 500, all have heard of the second one.
  Times times = schedule.Plan({120, std::nullopt, kTenPieces, 3, true});
  EXPECT_EQ(times.from_tick, 120);
  // Shortly before it some would go over to the first one.
  times = schedule.Plan({490, std::nullopt, kTenPieces, 3, true});
  EXPECT_EQ(times.from_tick, 500);
  EXPECT_EQ(times.switch_tick, 500 + 15 + vm::SpreadTicks(1280, 3));
  EXPECT_EQ(schedule.Plan({500, std::nullopt, kTenPieces, 3, true}).from_tick, 500);
}

TEST(DeploymentScheduleTest, AProgramThatIsWithdrawnHoldsNobodyUp) {
  DeploymentSchedule schedule(kMinute);
  const Order whole = {100, 10.0, kTenPieces, 3, true};
  schedule.Begin(whole, schedule.Plan(whole));
  const Order withdrawn = {485, 10.2, kTenPieces, 3, true};
  EXPECT_EQ(schedule.Begin(withdrawn, schedule.Plan(withdrawn)).number, 3u);
  // Of the second one not all pieces have gone out: the first one is what waits.
  EXPECT_EQ(schedule.Plan({490, std::nullopt, kTenPieces, 3, false}).from_tick, 500);
  EXPECT_EQ(schedule.Plan({490, std::nullopt, kTenPieces, 3, true}).from_tick, 510);
}

}  // namespace
}  // namespace morphbus::tools
