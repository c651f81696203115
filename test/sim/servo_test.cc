#include "sim/servo.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace morphbus::sim {
namespace {

constexpr double kGain = 60.0;
constexpr double kDt = 1e-3;

Servo MakeServo() { return Servo({-1.0, 2.0, 3.0}, kGain); }

TEST(ServoTest, SetPointMovesAtTheCommandedSpeed) {
  Servo servo = MakeServo();
  servo.Command({ServoMode::kPosition, 1.0, 2.0});
  for (int i = 0; i < 100; ++i) servo.Step(0.0, 0.0, kDt);
  EXPECT_NEAR(servo.set_point(), 0.2, 1e-12);
  for (int i = 0; i < 1000; ++i) servo.Step(0.0, 0.0, kDt);
  EXPECT_EQ(servo.set_point(), 1.0);
}

TEST(ServoTest, SpeedsBeyondTheJointsAreCutToIt) {
  Servo servo = MakeServo();
  servo.Command({ServoMode::kPosition, 1.0, 100.0});
  servo.Step(0.0, 0.0, kDt);
  EXPECT_NEAR(servo.set_point(), 3.0 * kDt, 1e-15);
  servo.Command({ServoMode::kVelocity, 0.0, -100.0});
  servo.Step(0.0, 0.0, kDt);
  EXPECT_NEAR(servo.set_point(), 0.0, 1e-15);
}

TEST(ServoTest, TargetsBeyondTheLimitsAreClamped) {
  Servo servo = MakeServo();
  servo.Command({ServoMode::kPosition, 5.0, 3.0});
  for (int i = 0; i < 2000; ++i) servo.Step(servo.set_point(), 0.0, kDt);
  EXPECT_EQ(servo.set_point(), 2.0);
  servo.Command({ServoMode::kVelocity, 0.0, -3.0});
  for (int i = 0; i < 2000; ++i) servo.Step(servo.set_point(), 0.0, kDt);
  EXPECT_EQ(servo.set_point(), -1.0);
}

TEST(ServoTest, HoldKeepsThePresentSetPointNotTheTarget) {
  Servo servo = MakeServo();
  servo.Command({ServoMode::kPosition, 1.0, 2.0});
  for (int i = 0; i < 100; ++i) servo.Step(0.0, 0.0, kDt);
  servo.Command({ServoMode::kHold, 0.0, 0.0});
  for (int i = 0; i < 100; ++i) servo.Step(0.0, 0.0, kDt);
  EXPECT_NEAR(servo.set_point(), 0.2, 1e-12);
}

TEST(ServoTest, ALimpJointTakesItsSetPointAlongAndIsHeldFromThere) {
  Servo servo({-1, 1, 2}, 60);
  EXPECT_FALSE(servo.limp());
  servo.Command({.mode = ServoMode::kLimp});
  EXPECT_TRUE(servo.limp());
  EXPECT_EQ(servo.Step(0.3, 0, 1e-3), 0) << "nothing is asked for";
  EXPECT_EQ(servo.set_point(), 0.3);
  servo.Command({});
  EXPECT_FALSE(servo.limp());
  servo.Step(0.5, 0, 1e-3);
  EXPECT_EQ(servo.set_point(), 0.3);
}

TEST(ServoTest, NumbersThatAreNotFiniteHold) {
  const double nan = std::nan("");
  const double infinity = std::numeric_limits<double>::infinity();
  for (const ServoCommand& bad : {ServoCommand{ServoMode::kPosition, nan, 1.0},
                                  ServoCommand{ServoMode::kPosition, 1.0, infinity},
                                  ServoCommand{ServoMode::kVelocity, 0.0, nan}}) {
    Servo servo = MakeServo();
    servo.Command(bad);
    EXPECT_EQ(servo.Step(0.0, 0.0, kDt), 0.0);
    EXPECT_EQ(servo.set_point(), 0.0);
  }
}

TEST(ServoTest, VelocityIsTheErrorTimesTheGain) {
  Servo servo = MakeServo();
  servo.Command({ServoMode::kPosition, 0.001, 3.0});
  EXPECT_NEAR(servo.Step(0.0, 0.0, kDt), kGain * 0.001, 1e-12);
}

TEST(ServoTest, AFastJointIsAskedForNoMoreThanItsSpeed) {
  Servo servo = MakeServo();
  servo.set_set_point(2.0);
  EXPECT_EQ(servo.Step(0.0, 3.0, kDt), 3.0);
  EXPECT_EQ(servo.Step(0.0, 4.0, kDt), 3.0);
  EXPECT_GT(servo.Step(0.0, 0.0, kDt), 3.0);
}

TEST(ServoTest, ATurningJointThatIsHeldPushesOnButDoesNotWindUp) {
  Servo servo({-1e9, 1e9, 3.0}, kGain);
  servo.Command({ServoMode::kVelocity, 0.0, 3.0});
  // Ten seconds at 3 rad/s would be 30 rad; the set-point stays a quarter ahead of the joint.
  for (int i = 0; i < 10000; ++i) servo.Step(0.0, 0.0, kDt);
  EXPECT_NEAR(servo.set_point(), 0.25, 1e-12);
  EXPECT_GE(servo.Step(0.0, 0.0, kDt), 3.0);
  // Freed at another place, it goes on from there.
  for (int i = 0; i < 200; ++i) servo.Step(5.0, 3.0, kDt);
  EXPECT_NEAR(servo.set_point(), 5.25, 1e-12);
}

TEST(ServoTest, MirroredCommandsGiveMirroredAnswersToTheLastBit) {
  Servo left({-1.0, 2.0, 3.0}, kGain);
  Servo right({-2.0, 1.0, 3.0}, kGain);
  double position = 0.0;
  double rate = 0.0;
  for (int i = 0; i < 3000; ++i) {
    if (i % 700 == 0) {
      const double target = 0.37 * (i / 700) - 0.5;
      left.Command({ServoMode::kPosition, target, 1.7});
      right.Command({ServoMode::kPosition, -target, 1.7});
    }
    const double v = left.Step(position, rate, kDt);
    ASSERT_EQ(right.Step(-position, -rate, kDt), -v);
    rate = 0.8 * v;
    position += rate * kDt;
  }
}

}  // namespace
}  // namespace morphbus::sim
