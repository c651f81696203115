// Which members of a run have done what the simulator waits for.

#include "bridge/lockstep/sim/attendance.h"

#include <gtest/gtest.h>

namespace morphbus::bridge {
namespace {

TEST(Attendance, EveryMemberCountsOnceAndStrangersNever) {
  Attendance attendance(2, true);
  EXPECT_EQ(attendance.size(), 3);
  for (const int member : {0, 2, 1}) {
    EXPECT_FALSE(attendance.AllGreeted());
    EXPECT_TRUE(attendance.Greet(member));
    EXPECT_FALSE(attendance.Greet(member));
  }
  EXPECT_TRUE(attendance.AllGreeted());
  for (const int stranger : {-1, 3}) EXPECT_FALSE(attendance.Acknowledge(stranger));
  EXPECT_FALSE(attendance.Answer(2)) << "the logger answers no ticks";
  EXPECT_TRUE(attendance.Answer(1));
  EXPECT_FALSE(attendance.Answer(1));
  EXPECT_EQ(attendance.num_missing(), 1);
  EXPECT_TRUE(attendance.Answer(0));
  EXPECT_TRUE(attendance.AllAnswered());
  attendance.BeginTick();
  EXPECT_EQ(attendance.num_missing(), 2);
  EXPECT_EQ(attendance.num_answers(), 0);
  EXPECT_TRUE(attendance.Acknowledge(0) && attendance.Acknowledge(1));
  EXPECT_TRUE(attendance.AllModulesAcknowledged());
  EXPECT_FALSE(attendance.acknowledged(2));
}

TEST(Attendance, AModuleThatWasAskedToLeaveIsAwaitedUntilItHas) {
  Attendance attendance(2, false);
  EXPECT_FALSE(attendance.Leave(1)) << "it was not asked to";
  attendance.AskToLeave(1);
  EXPECT_TRUE(attendance.lost(1) && attendance.AnyLeaving() && !attendance.gone(1));
  EXPECT_EQ(attendance.num_missing(), 2) << "the tick that is out it still answers";
  EXPECT_TRUE(attendance.Answer(0) && attendance.Answer(1));
  EXPECT_TRUE(attendance.Leave(1));
  EXPECT_TRUE(attendance.gone(1) && attendance.acknowledged(1) && !attendance.AnyLeaving());
  attendance.BeginTick();
  EXPECT_EQ(attendance.num_missing(), 1);
  EXPECT_TRUE(attendance.Answer(0) && attendance.AllAnswered());
}

TEST(Attendance, ARunThatGoesOnWithoutAModuleAtOnceAwaitsNoAnswerOfIt) {
  for (const bool answered : {false, true}) {
    Attendance attendance(2, false);
    if (answered) attendance.Answer(1);
    attendance.AskToLeave(1);
    attendance.GoOnWithout(1);
    EXPECT_EQ(attendance.num_missing(), 1);
    attendance.BeginTick();
    EXPECT_EQ(attendance.num_missing(), 1);
  }
}

}  // namespace
}  // namespace morphbus::bridge
