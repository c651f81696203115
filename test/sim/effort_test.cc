// What motors exert and what the ground exerts, as SENSORS and WORLD tell it, against statics.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "sim/bullet_robot.h"
#include "test/sim/mtran.h"
#include "test/sim/toy_robots.h"

namespace morphbus::sim {
namespace {

using Eigen::Vector3d;

/// A base of 20 kg that stands on the ground, and on its side an arm of 1 kg that nothing else
/// holds: its centre of mass is 0.2 m north of its hinge about z, east, or it slides along y, up.
constexpr double kArmKg = 1.0;
constexpr double kArmLength = 0.2;

std::shared_ptr<const model::Model> MakeArm(model::JointType type, bool arm_is_first) {
  auto model = std::make_shared<model::Model>(*test::MakePair(type, 0.0));
  model::ModuleType& module = model->module_types[0];
  const Vector3d hinge(0.12, 0, 0);
  model::Link base{"base", test::BoxCorners(Vector3d::Constant(-0.1), Vector3d::Constant(0.1)), {}};
  base.mass_kg = 20.0;
  const Vector3d centre = hinge + Vector3d(kArmLength, 0, 0), half(0.05, 0.02, 0.02);
  model::Link arm{"arm", test::BoxCorners(centre - half, centre + half), {}};
  arm.mass_kg = kArmKg;
  module.links = arm_is_first ? std::vector{arm, base} : std::vector{base, arm};
  model::Joint& joint = module.joints[0];
  joint.p_MoJo_M = hinge;
  joint.axis = type == model::JointType::kPrismatic ? Vector3d::UnitY() : Vector3d::UnitZ();
  return model;
}

std::unique_ptr<BulletRobot> MakeRobot(const std::shared_ptr<const model::Model>& model) {
  auto made = BulletRobot::Create(model, "pair", {});
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return std::move(*made);
}

/// Lets a robot of one joint go on for so many ticks with its joint on the way to a target; the
/// work that its motor does on the way, by what is sensed (J).
double Move(BulletRobot* robot, double target, double speed, int ticks) {
  std::vector<morphbus::module_sensors_t> sensed;
  robot->Sense(&sensed);
  double work = 0.0, before = sensed[0].joint_position_si[0];
  for (int tick = 0; tick < ticks; ++tick) {
    robot->Actuate(test::PositionCommand(target, speed));
    robot->Advance();
    robot->Sense(&sensed);
    const double now = sensed[0].joint_position_si[0];
    work += static_cast<double>(sensed[0].joint_effort_si[0]) * (now - before);
    before = now;
  }
  return work;
}

double EffortOf(BulletRobot* robot) {
  std::vector<morphbus::module_sensors_t> sensed;
  robot->Sense(&sensed);
  return static_cast<double>(sensed[0].joint_effort_si[0]);
}

TEST(EffortTest, BeforeTheFirstTickNothingIsExerted) {
  const auto robot = MakeRobot(MakeArm(model::JointType::kRevolute, true));
  EXPECT_EQ(EffortOf(robot.get()), 0.0);
  std::vector<morphbus::contact_force_t> contacts(3);
  robot->ContactForces(&contacts);
  EXPECT_TRUE(contacts.empty());
}

TEST(EffortTest, AnArmHeldLevelTakesItsWeightTimesItsLength) {
  // The hinge turns its first link about +z for positive values: that lifts an arm to the north.
  for (const bool arm_is_first : {true, false}) {
    const auto robot = MakeRobot(MakeArm(model::JointType::kRevolute, arm_is_first));
    Move(robot.get(), 0.0, 1.0, 100);
    const double expected = kArmKg * test::kGravity * kArmLength * (arm_is_first ? 1.0 : -1.0);
    EXPECT_NEAR(EffortOf(robot.get()), expected, 0.01 * std::abs(expected));
  }
}

TEST(EffortTest, ASliderThatHoldsALoadExertsItsWeight) {
  for (const bool arm_is_first : {true, false}) {
    const auto robot = MakeRobot(MakeArm(model::JointType::kPrismatic, arm_is_first));
    Move(robot.get(), 0.0, 0.1, 100);
    const double expected = kArmKg * test::kGravity * (arm_is_first ? 1.0 : -1.0);
    EXPECT_NEAR(EffortOf(robot.get()), expected, 0.01 * std::abs(expected));
  }
}

TEST(EffortTest, LiftingTakesTheEnergyThatTheLoadGains) {
  const auto hinge = MakeRobot(MakeArm(model::JointType::kRevolute, true));
  Move(hinge.get(), -0.2, 1.0, 100);
  const double turned = Move(hinge.get(), 0.8, 1.0, 150);
  const double gained = kArmKg * test::kGravity * kArmLength * (std::sin(0.2) + std::sin(0.8));
  EXPECT_NEAR(turned, gained, 0.01 * gained);
  const auto slider = MakeRobot(MakeArm(model::JointType::kPrismatic, true));
  Move(slider.get(), -0.04, 0.1, 100);
  const double lifted = Move(slider.get(), 0.04, 0.1, 100);
  EXPECT_NEAR(lifted, kArmKg * test::kGravity * 0.08, 0.01 * kArmKg * test::kGravity * 0.08);
}

/// The sum of the forces, and what else is to be seen of a list of them.
Vector3d SumOf(const std::vector<morphbus::contact_force_t>& contacts) {
  Vector3d sum = Vector3d::Zero();
  for (size_t i = 0; i < contacts.size(); ++i) {
    sum += Eigen::Map<const Eigen::Vector3f>(contacts[i].force_n).cast<double>();
    // In order, and each link once.
    if (i == 0) continue;
    EXPECT_LT(std::pair(contacts[i - 1].module_id, contacts[i - 1].link),
              std::pair(contacts[i].module_id, contacts[i].link));
  }
  return sum;
}

TEST(EffortTest, TheGroundCarriesTheRobotsWeight) {
  const auto robot = MakeRobot(MakeArm(model::JointType::kRevolute, true));
  Move(robot.get(), 0.0, 1.0, 100);
  std::vector<morphbus::contact_force_t> contacts;
  robot->ContactForces(&contacts);
  // The arm is in the air.
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_EQ(contacts[0].link, 1);
  EXPECT_NEAR((SumOf(contacts) - Vector3d(0, 21.0 * test::kGravity, 0)).norm(), 0.0,
              0.01 * 21 * test::kGravity);
}

TEST(EffortTest, AnObstacleCarriesItTooAndFrictionPushesAlongTheGround) {
  const auto model = test::MakeBox();
  BulletRobotOptions options;
  world::Obstacle floor;
  floor.size = Vector3d(1, 0.2, 1);
  floor.X_WO.translation() = Vector3d(0, -0.1, 0);
  options.world.obstacles = {floor};
  options.world.ground = false;
  const auto robot = std::move(*BulletRobot::Create(model, "box", options));
  for (int tick = 0; tick < 50; ++tick) robot->Advance();
  std::vector<morphbus::contact_force_t> contacts;
  robot->ContactForces(&contacts);
  EXPECT_NEAR((SumOf(contacts) - Vector3d(0, test::kGravity, 0)).norm(), 0.0,
              0.01 * test::kGravity);
  // A push of 3 N that friction (0.8) withstands is met by as much of the other sign.
  ASSERT_TRUE(robot->Push("m1", {0, 0, 3.0}, "", 1.0));
  for (int tick = 0; tick < 40; ++tick) robot->Advance();
  robot->ContactForces(&contacts);
  EXPECT_NEAR((SumOf(contacts) - Vector3d(0, test::kGravity, -3.0)).norm(), 0.0,
              0.05 * test::kGravity);
}

TEST(EffortTest, WhatNothingTouchesHasNoContacts) {
  BulletRobotOptions options;
  options.world.ground = false;
  const auto robot = std::move(*BulletRobot::Create(test::MtranModel(), "quadruped", options));
  for (int tick = 0; tick < 5; ++tick) robot->Advance();
  std::vector<morphbus::contact_force_t> contacts;
  robot->ContactForces(&contacts);
  EXPECT_TRUE(contacts.empty());
}

/// A quadruped on its walk.
struct Walk {
  explicit Walk(const std::string& name)
      : robot(std::move(*BulletRobot::Create(test::MtranModel(), name, {}))),
        parts(test::AssignParts(robot->model(), robot->robot())) {}

  void Advance() {
    const test::Posture posture = test::GaitTargets(0.02 * tick++);
    std::vector<morphbus::actuator_t> commands(9);
    for (size_t m = 0; m < commands.size(); ++m) {
      commands[m] = {};
      commands[m].module_id = static_cast<int16_t>(m);
      commands[m].num_joints = 2;
      commands[m].joints.resize(2);
      for (auto& joint : commands[m].joints) joint = {};
    }
    for (size_t leg = 0; leg < test::kNumLegs; ++leg) {
      for (size_t part = 0; part < test::kNumParts; ++part) {
        const test::FunctionalJoint& joint = parts[leg][part];
        morphbus::joint_command_t& command = commands[joint.module].joints[joint.joint];
        command.mode = morphbus::joint_command_t::MODE_POSITION;
        command.target_si = joint.sign * posture[leg][part];
        command.speed_si = std::numbers::pi;
      }
    }
    for (const morphbus::actuator_t& command : commands) robot->Actuate(command);
    robot->Advance();
  }

  /// By what joints are for, under the paper's conventions.
  [[nodiscard]] std::vector<double> Efforts() const {
    std::vector<morphbus::module_sensors_t> sensed;
    robot->Sense(&sensed);
    std::vector<double> efforts;
    for (const auto& leg : parts) {
      for (const test::FunctionalJoint& joint : leg) {
        efforts.push_back(joint.sign *
                          static_cast<double>(sensed[joint.module].joint_effort_si[joint.joint]));
      }
    }
    return efforts;
  }
  /// Without saying whose they are.
  [[nodiscard]] std::vector<std::array<float, 3>> Forces() const {
    std::vector<morphbus::contact_force_t> contacts;
    robot->ContactForces(&contacts);
    std::vector<std::array<float, 3>> forces;
    for (const auto& c : contacts) forces.push_back({c.force_n[0], c.force_n[1], c.force_n[2]});
    std::sort(forces.begin(), forces.end());
    return forces;
  }

  std::unique_ptr<BulletRobot> robot;
  test::Quadruped parts;
  int tick = 0;
};

TEST(EffortTest, EquivalentRobotsExertTheSameAndSoDoesASecondRun) {
  Walk one("quadruped"), again("quadruped"), other("equivalent_quadruped");
  double largest = 0.0;
  for (int tick = 0; tick < 200; ++tick) {
    for (Walk* walk : {&one, &again, &other}) walk->Advance();
    ASSERT_EQ(one.Efforts(), again.Efforts()) << "tick " << tick;
    ASSERT_EQ(one.Efforts(), other.Efforts()) << "tick " << tick;
    ASSERT_EQ(one.Forces(), other.Forces()) << "tick " << tick;
    for (const double effort : one.Efforts()) largest = std::max(largest, std::abs(effort));
  }
  EXPECT_GT(largest, 0.5);
  EXPECT_LE(largest, 1.9 + 1e-6);
}

TEST(EffortTest, AQuadrupedThatStandsIsCarriedByItsFeet) {
  Walk walk("quadruped");
  while (walk.tick < 120) walk.Advance();
  std::vector<morphbus::contact_force_t> contacts;
  walk.robot->ContactForces(&contacts);
  EXPECT_GE(contacts.size(), 3u);
  const double weight = 9 * 0.42 * test::kGravity;
  EXPECT_NEAR(SumOf(contacts).y(), weight, 0.01 * weight);
}

}  // namespace
}  // namespace morphbus::sim
