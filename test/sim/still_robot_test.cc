#include "sim/still_robot.h"

#include <gtest/gtest.h>

#include <numbers>

#include "compiler/m3l/compile.h"
#include "compiler/source/diagnostics.h"
#include "sim/bullet_robot.h"
#include "test/sim/mtran.h"

namespace morphbus::sim {
namespace {

using morphbus::joint_command_t;
using Sensors = std::vector<morphbus::module_sensors_t>;

std::unique_ptr<StillRobot> MakeStill() {
  auto made = StillRobot::Create(test::MtranModel(), "quadruped", 20000, 1000);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return std::move(*made);
}

Sensors SensorsOf(bridge::SimulatedRobot* robot) {
  Sensors sensors;
  robot->Sense(&sensors);
  return sensors;
}

// A command to the first joint of the first module; the second one holds.
morphbus::actuator_t Drive(int8_t mode, double target, double speed) {
  morphbus::actuator_t command = {};
  command.num_joints = 2;
  command.joints.resize(2);
  command.joints[0].mode = mode;
  command.joints[0].target_si = target;
  command.joints[0].speed_si = speed;
  command.joints[1].mode = joint_command_t::MODE_HOLD;
  return command;
}

TEST(StillRobotTest, AtTheStartItSensesWhatARobotWithPhysicsDoes) {
  const auto with_physics = std::move(*BulletRobot::Create(test::MtranModel(), "quadruped", {}));
  const auto still = MakeStill();
  const Sensors expected = SensorsOf(with_physics.get());
  const Sensors sensed = SensorsOf(still.get());
  ASSERT_EQ(sensed.size(), expected.size());
  for (size_t m = 0; m < sensed.size(); ++m) {
    EXPECT_EQ(sensed[m].name, expected[m].name);
    EXPECT_EQ(sensed[m].joint_position_si, expected[m].joint_position_si);
    EXPECT_EQ(sensed[m].joint_velocity_si, expected[m].joint_velocity_si);
    EXPECT_EQ(sensed[m].joint_effort_si, expected[m].joint_effort_si);
    // Everything that is told of a connector, as bytes.
    ASSERT_EQ(sensed[m].docked.size(), expected[m].docked.size());
    for (size_t d = 0; d < sensed[m].docked.size(); ++d) {
      std::vector<uint8_t> one(sensed[m].docked[d]._getEncodedSizeNoHash());
      std::vector<uint8_t> other(one.size());
      sensed[m].docked[d]._encodeNoHash(one.data(), 0, static_cast<int>(one.size()));
      expected[m].docked[d]._encodeNoHash(other.data(), 0, static_cast<int>(other.size()));
      EXPECT_EQ(one, other) << sensed[m].name;
    }
  }
}

TEST(StillRobotTest, SensorsThatSeeNothingSayTheSameInEveryTick) {
  const m3l::CompileOutput output = m3l::CompileText("eye.m3l", R"(
      module EYE: unit=0.1
      point p: coords=(0,0,0)
      link body: grouping=(p), mass=1
      axis front: origin=(0,0,0), direction=(1,0,0)
      sensor eye: type=distance, link=body, origin=(0,0,0), direction=(0,0,1), range=5
      sensor up: type=tilt, link=body, origin=(0,0,0), direction=(0,1,0)
      robot eyes: modules=(EYE e))");
  ASSERT_TRUE(output.model) << source::Render(output.diagnostics, output.sources, false);
  const auto robot = std::move(*StillRobot::Create(
      std::make_shared<const model::Model>(*output.model), "eyes", 20000, 1000));
  // The vector is used again from tick to tick, as a run does.
  Sensors sensors;
  for (int tick = 0; tick < 3; ++tick) {
    robot->Sense(&sensors);
    ASSERT_EQ(sensors[0].sensor_value, (std::vector<float>{0.5F, 0.0F, 1.0F, 0.0F})) << tick;
    robot->Advance();
  }
}

TEST(StillRobotTest, JointsGoToTheirTargetsAtTheSpeedAskedFor) {
  const auto robot = MakeStill();
  constexpr double kSpeed = 1.5;
  for (int tick = 1; tick <= 30; ++tick) {
    robot->Actuate(Drive(joint_command_t::MODE_POSITION, 0.5, kSpeed));
    robot->Advance();
    const Sensors sensors = SensorsOf(robot.get());
    EXPECT_NEAR(sensors[0].joint_position_si[0], std::min(0.5, kSpeed * 0.02 * tick), 1e-12);
    EXPECT_EQ(sensors[0].joint_position_si[1], 0.0);
    if (tick <= 16) {
      EXPECT_NEAR(sensors[0].joint_velocity_si[0], kSpeed, 1e-6);
    }
  }
  EXPECT_EQ(SensorsOf(robot.get())[0].joint_velocity_si[0], 0.0F);
}

TEST(StillRobotTest, TargetsAndTurningStopAtTheLimits) {
  const auto robot = MakeStill();
  for (int tick = 0; tick < 100; ++tick) {
    robot->Actuate(Drive(joint_command_t::MODE_POSITION, 10.0, 100.0));
    robot->Advance();
  }
  EXPECT_NEAR(SensorsOf(robot.get())[0].joint_position_si[0], std::numbers::pi / 2, 1e-9);
  for (int tick = 0; tick < 200; ++tick) {
    robot->Actuate(Drive(joint_command_t::MODE_VELOCITY, 0.0, -2.0));
    robot->Advance();
  }
  EXPECT_NEAR(SensorsOf(robot.get())[0].joint_position_si[0], -std::numbers::pi / 2, 1e-9);
}

/// Turns both joints of m2 towards an angle (rad), for 20 ticks at 3 rad/s.
void TurnSecondModule(StillRobot* robot, double angle) {
  for (int tick = 0; tick < 20; ++tick) {
    morphbus::actuator_t command = Drive(joint_command_t::MODE_POSITION, angle, 3.0);
    command.module_id = 1;
    command.joints[1] = command.joints[0];
    robot->Actuate(command);
    robot->Advance();
  }
}

TEST(StillRobotTest, ConnectionsComeApartAndAreMadeWhereTheLinksAre) {
  const auto robot = MakeStill();
  const size_t before = SensorsOf(robot.get())[0].docked.size();
  ASSERT_TRUE(robot->Disconnect("m1", "c2"));
  EXPECT_EQ(SensorsOf(robot.get())[0].docked.size(), before - 1);
  EXPECT_FALSE(robot->Disconnect("m1", "c2"));
  EXPECT_FALSE(robot->Connect("m1", "c5"));  // Nothing lies before it.
  // What came apart stays where it is while its joints stand still, and is joined again.
  robot->Advance();
  ASSERT_TRUE(robot->Connect("m1", "c2"));
  EXPECT_EQ(SensorsOf(robot.get())[0].docked.size(), before);
  // Turned away, it meets nothing.
  ASSERT_TRUE(robot->Disconnect("m1", "c2"));
  TurnSecondModule(robot.get(), 1.0);
  EXPECT_FALSE(robot->Connect("m1", "c2"));
}

TEST(StillRobotTest, WhatComesApartStaysWhereItsJointsHadTakenIt) {
  const auto robot = MakeStill();
  // Turning m2 moves all of it but the block that m1 holds.
  TurnSecondModule(robot.get(), 0.8);
  ASSERT_TRUE(robot->Disconnect("m1", "c2"));
  robot->Advance();
  EXPECT_TRUE(robot->Connect("m1", "c2"));
}

/// A tower that grips a tool, "shut" or "tight" but not "open" nor "oiled".
std::unique_ptr<StillRobot> MakeStation() {
  const m3l::CompileOutput output = m3l::CompileText("station.m3l", R"(
      module TOWER: unit=0.1
      point top: coords=(0,0,1), connector, normal=(0,0,1), grip=["open","shut","oiled","tight"]
      link foot: grouping=(top), mass=1
      axis front: origin=(0,0,0), direction=(1,0,0)
      module TOOL: unit=0.1
      point base: coords=(0,0,0), connector, normal=(0,0,-1)
      link body: grouping=(base), mass=0.2
      axis front: origin=(0,0,0), direction=(1,0,0)
      connection GRIP: members=(TOWER a, TOOL b), conditions=(
        a.point p coincident b.point q and p antiparallel q and a.front parallel b.front
        and (p.grip=="shut" or p.grip=="tight"))
      robot station: modules=(TOWER t, TOOL k), connections=((t.top,k.base)))");
  EXPECT_TRUE(output.model) << source::Render(output.diagnostics, output.sources, false);
  auto made = StillRobot::Create(std::make_shared<const model::Model>(*output.model), "station",
                                 20000, 1000);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return std::move(*made);
}

TEST(StillRobotTest, AConnectionHoldsInEachOfItsSettingsAndPartsInNone) {
  const auto robot = MakeStation();
  // Sets the tower's grip to a value of the list, and tells whether it holds the tool then.
  const auto holds_with_grip = [&](int8_t value) {
    morphbus::actuator_t command = {};
    command.num_connectors = 1;
    command.connectors.resize(1);
    command.connectors[0].connector = 0;
    command.connectors[0].state = 0;
    command.connectors[0].value = value;
    robot->Actuate(command);
    robot->Advance();
    return !SensorsOf(robot.get())[0].docked.empty();
  };
  constexpr int8_t kOpen = 0;
  constexpr int8_t kShut = 1;
  constexpr int8_t kOiled = 2;
  constexpr int8_t kTight = 3;
  EXPECT_TRUE(holds_with_grip(kShut));
  EXPECT_TRUE(holds_with_grip(kTight));
  EXPECT_FALSE(holds_with_grip(kOiled));
  EXPECT_FALSE(holds_with_grip(kOpen));
  // It takes the tool again in either.
  EXPECT_TRUE(holds_with_grip(kTight));
  EXPECT_FALSE(holds_with_grip(kOpen));
  EXPECT_TRUE(holds_with_grip(kShut));
}

TEST(StillRobotTest, WhatItCannotBeIsRefusedAndWhatItDoesNotKnowIsIgnored) {
  EXPECT_FALSE(StillRobot::Create(test::MtranModel(), "centipede", 20000, 1000));
  EXPECT_FALSE(StillRobot::Create(test::MtranModel(), "quadruped", 20000, 3000));
  const auto robot = MakeStill();
  morphbus::actuator_t command = Drive(joint_command_t::MODE_POSITION, 1, 1);
  command.module_id = 99;
  robot->Actuate(command);
  command.module_id = -1;
  robot->Actuate(command);
  command.module_id = 0;
  command.num_joints = 1;
  command.joints.resize(1);
  robot->Actuate(command);
  robot->Advance();
  EXPECT_GT(SensorsOf(robot.get())[0].joint_position_si[0], 0.0);
}

}  // namespace
}  // namespace morphbus::sim
