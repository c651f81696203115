#include "logger/compare/walk_figures.h"

#include <gtest/gtest.h>

#include <cmath>

namespace morphbus::logger {
namespace {

std::vector<CommandEvent> Events(const std::vector<std::pair<double, double>>& list) {
  std::vector<CommandEvent> events;
  for (const auto& [t, target] : list) events.push_back({std::llround(t * 1e6), target});
  return events;
}

TEST(FindPeriodTest, TheShortestRepetitionIsFoundAfterAnotherStart) {
  const auto period = FindPeriod(
      Events({{0.1, 9}, {2, 1}, {3, 2}, {9, 1}, {10, 2}, {16, 1}, {17, 2}, {23, 1}, {24, 2}}),
      40000);
  ASSERT_TRUE(period.has_value());
  EXPECT_EQ(period->period_us, 7000000);
  EXPECT_EQ(period->first_us, 2000000);
}

TEST(FindPeriodTest, APartThatBeginsWithinACycleCounts) {
  const auto period = FindPeriod(Events({{3, 2}, {9, 1}, {10, 2}, {16, 1}, {17, 2}}), 40000);
  ASSERT_TRUE(period.has_value());
  EXPECT_EQ(period->first_us, 3000000);
}

TEST(FindPeriodTest, WhatDoesNotRepeatTwiceHasNoPeriod) {
  EXPECT_FALSE(FindPeriod(Events({{1, 1}, {2, 2}, {3, 3}, {4, 4}}), 40000).has_value());
  EXPECT_FALSE(FindPeriod({}, 40000).has_value());
  EXPECT_FALSE(FindPeriod(Events({{1, 1}}), 40000).has_value());
}

TEST(FindPeriodTest, UnevenTimesAreNoPeriod) {
  EXPECT_FALSE(FindPeriod(Events({{1, 1}, {2, 2}, {9, 1}, {12, 2}}), 40000).has_value());
}

RunLog StraightWalk(double speed_m_s, double turn_rad_s) {
  RunLog log;
  log.tick_us = 20000;
  ModuleSeries module;
  for (int64_t t = 0; t <= 30000000; t += 20000) {
    const double s = static_cast<double>(t) * 1e-6;
    WorldSample world;
    world.time_us = t;
    morphbus::body_pose_t pose = {};
    pose.position_m[0] = speed_m_s * s;
    pose.position_m[1] = 0.2;
    pose.orientation_wxyz[0] = std::cos(turn_rad_s * s / 2);
    pose.orientation_wxyz[2] = std::sin(turn_rad_s * s / 2);
    world.bodies.push_back(pose);
    log.world.push_back(world);
    ActuatorSample sample;
    sample.time_us = t;
    morphbus::joint_command_t command = {};
    command.mode = morphbus::joint_command_t::MODE_POSITION;
    command.target_si = (t / 2000000) % 2 == 0 ? 0.5 : -0.5;  // up and down, 4 s in all
    sample.joints.push_back(command);
    module.actuators.push_back(sample);
  }
  log.modules.push_back(module);
  return log;
}

TEST(MeasureWalkTest, AStraightWalkHasEqualCycles) {
  const auto figures = MeasureWalk(StraightWalk(0.02, 0.0), TrackedBody{});
  ASSERT_TRUE(figures.has_value());
  EXPECT_DOUBLE_EQ(figures->cycle_s, 4.0);
  ASSERT_EQ(figures->cycle_north_m.size(), 7u);
  for (const double north : figures->cycle_north_m) EXPECT_NEAR(north, 0.08, 1e-12);
  EXPECT_NEAR(figures->turn_rad, 0.0, 1e-12);
  EXPECT_NEAR(figures->max_tilt_rad, 0.0, 1e-7);
  EXPECT_DOUBLE_EQ(figures->min_height_m, 0.2);
}

TEST(MeasureWalkTest, WhatOnlyOneJointRepeatsIsNoCycle) {
  RunLog log = StraightWalk(0.02, 0.0);
  for (ActuatorSample& sample : log.modules[0].actuators) {
    morphbus::joint_command_t other = {};
    other.mode = morphbus::joint_command_t::MODE_POSITION;
    other.target_si = sample.time_us < 17000000 ? 0.0 : 1.0;  // once, in the middle of a cycle
    sample.joints.push_back(other);
  }
  EXPECT_TRUE(MeasureWalk(log, TrackedBody{})->cycle_north_m.empty());
}

/// A joint that goes to and fro every 2 s.
void AddQuickJoint(ModuleSeries* module, double amplitude) {
  for (ActuatorSample& sample : module->actuators) {
    const int64_t t = sample.time_us;
    morphbus::joint_command_t command = {};
    command.mode = morphbus::joint_command_t::MODE_POSITION;
    command.target_si = (t / 1000000) % 2 == 0 ? amplitude : -amplitude;
    sample.joints.push_back(command);
  }
}

TEST(MeasureWalkTest, ThePeriodIsTheOneThatAllJointsKeepWhicheverIsTheBusiest) {
  // The second joint is told more and travels more, and repeats every 2 s, which the first does
  // not.
  for (const bool first : {false, true}) {
    RunLog log = StraightWalk(0.02, 0.0);
    ModuleSeries busy = log.modules[0];
    for (ActuatorSample& sample : busy.actuators) sample.joints.clear();
    AddQuickJoint(&busy, 1.0);
    log.modules.insert(first ? log.modules.begin() : log.modules.end(), busy);
    EXPECT_DOUBLE_EQ(MeasureWalk(log, TrackedBody{})->cycle_s, 4.0) << first;
  }
}

TEST(MeasureWalkTest, TurningLeftIsPositive) {
  // About +y (up), from +x (north) towards -z (west).
  EXPECT_NEAR(MeasureWalk(StraightWalk(0.0, 0.01), TrackedBody{})->turn_rad, 0.3, 1e-9);
}

TEST(MeasureWalkTest, ThePointIsCarriedByTheBody) {
  TrackedBody body;
  body.X_LP.setIdentity();
  body.X_LP.translation() = Eigen::Vector3d(1, 0, 0);  // a metre north of the link's origin
  const auto displacement = MeasureDisplacement(StraightWalk(0.0, 0.01), body);
  ASSERT_TRUE(displacement.has_value());
  EXPECT_NEAR(displacement->x(), std::cos(0.3) - 1, 1e-9);
  EXPECT_NEAR(displacement->z(), -std::sin(0.3), 1e-9);
}

TEST(MeasureWalkTest, WithoutThatBodyThereIsNothingToMeasure) {
  EXPECT_FALSE(MeasureWalk(StraightWalk(0.0, 0.0), TrackedBody{{3, 0}, model::Pose::Identity()})
                   .has_value());
}

}  // namespace
}  // namespace morphbus::logger
