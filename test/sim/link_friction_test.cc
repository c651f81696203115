// Links with a friction of their own: by how they slide when they are pushed.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sim/bullet_robot.h"
#include "test/sim/toy_robots.h"

namespace morphbus::sim {
namespace {

using Eigen::Vector3d;
using Friction = std::optional<double>;

constexpr double kGravity = 9.81;
constexpr double kSeconds = 0.5;

/// A box of 1 kg that grips like this.
std::shared_ptr<const model::Model> Box(const Friction& friction) {
  auto model = std::make_shared<model::Model>(*test::MakeBox());
  model->module_types[0].links[0].friction = friction;
  return model;
}

/// Two boxes of 1 kg, one behind the other along x, that are one body.
std::shared_ptr<const model::Model> TwoBoxes(const Friction& first, const Friction& second) {
  auto model = std::make_shared<model::Model>(*test::MakePair(model::JointType::kFixed, 0.0));
  model->module_types[0].links[0].friction = first;
  model->module_types[0].links[1].friction = second;
  return model;
}

std::unique_ptr<BulletRobot> MakeRobot(const std::shared_ptr<const model::Model>& model,
                                       const WorldOptions& world = {}) {
  auto made = BulletRobot::Create(model, model->robots[0].name, {.world = world});
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return std::move(*made);
}

/// How far the robot goes in kSeconds with this force along x on it (m), from when it has come to
/// rest on the ground.
double Slide(BulletRobot* robot, double newtons) {
  for (int tick = 0; tick < 25; ++tick) robot->Advance();
  const double before = robot->LinkPose(0, 0).translation().x();
  EXPECT_TRUE(robot->Push("m1", Vector3d(newtons, 0, 0), "", kSeconds));
  for (int tick = 0; tick < kSeconds / 0.02; ++tick) robot->Advance();
  return robot->LinkPose(0, 0).translation().x() - before;
}

/// How far 1 kg gets in that time against this friction.
double Expected(double newtons, double friction) {
  return 0.5 * (newtons - friction * kGravity) * kSeconds * kSeconds;
}

TEST(LinkFriction, ALinkSlidesByItsOwnFriction) {
  // The world's 0.8 would hold it.
  EXPECT_NEAR(Slide(MakeRobot(Box({})).get(), 6.0), 0.0, 5e-3);
  for (const double friction : {0.0, 0.2, 0.5}) {
    const double slid = Slide(MakeRobot(Box(friction)).get(), 6.0);
    EXPECT_NEAR(slid, Expected(6.0, friction), 0.2 * Expected(6.0, friction));
    // As in a world where all things grip like that.
    EXPECT_NEAR(slid, Slide(MakeRobot(Box({}), {.friction = friction}).get(), 6.0), 1e-4);
  }
}

TEST(LinkFriction, ALinkMayGripMoreThanTheWorld) {
  EXPECT_NEAR(Slide(MakeRobot(Box(1.5), {.friction = 0.1}).get(), 6.0), 0.0, 5e-3);
  EXPECT_NEAR(Slide(MakeRobot(Box({}), {.friction = 0.1}).get(), 6.0), Expected(6.0, 0.1), 0.02);
}

TEST(LinkFriction, LinksOfOneBodyHaveEachItsOwn) {
  const double slow = Slide(MakeRobot(TwoBoxes(0.6, 0.6)).get(), 14.0);
  const double mixed = Slide(MakeRobot(TwoBoxes(0.2, 0.6)).get(), 14.0);
  const double mixed_back = Slide(MakeRobot(TwoBoxes(0.6, 0.2)).get(), 14.0);
  const double fast = Slide(MakeRobot(TwoBoxes(0.2, 0.2)).get(), 14.0);
  EXPECT_GT(mixed, 1.2 * slow);
  EXPECT_LT(mixed, 0.9 * fast);
  EXPECT_GT(mixed_back, 1.2 * slow);
  EXPECT_LT(mixed_back, 0.9 * fast);
}

TEST(LinkFriction, OnAnObstacleWithFrictionTheMeanOfBothCounts) {
  world::Obstacle table;
  table.name = "table";
  table.shape = world::Shape::kBox;
  table.size = {4.0, 4.0, 0.1};
  // The robot stands on y = 0, which is the table's upper side: its z is up.
  table.X_WO.linear() =
      Eigen::AngleAxisd(-std::numbers::pi / 2, Vector3d::UnitX()).toRotationMatrix();
  table.X_WO.translation() = Vector3d(0, -0.05, 0);
  table.friction = 0.1;
  const WorldOptions world = {.ground = false, .obstacles = {table}};
  const double mean = std::sqrt(0.4 * 0.1);
  EXPECT_NEAR(Slide(MakeRobot(Box(0.4), world).get(), 6.0), Expected(6.0, mean), 0.02);
  EXPECT_NEAR(Slide(MakeRobot(Box({}), world).get(), 6.0), Expected(6.0, 0.1), 0.02);
}

TEST(LinkFriction, StandsInTheHashOfTheWorldWhereItIsGiven) {
  const std::string without = MakeRobot(Box({}))->world_hash();
  // The world's own number on a link is not nothing: another contact may ask for it.
  EXPECT_NE(MakeRobot(Box(0.8))->world_hash(), without);
  EXPECT_NE(MakeRobot(Box(0.8))->world_hash(), MakeRobot(Box(0.7))->world_hash());
  EXPECT_EQ(MakeRobot(Box(0.8))->world_hash(), MakeRobot(Box(0.8))->world_hash());
}

}  // namespace
}  // namespace morphbus::sim
