// Sensors of M3L in the simulated world, against where things are known to be.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "compiler/m3l/compile.h"
#include "sim/bullet_robot.h"
#include "sim/link_physics.h"
#include "sim/still_robot.h"

namespace morphbus::sim {
namespace {

/// What shapes and the ground are smaller and higher by, in all.
constexpr double kSlack = 2 * kHullShrink + 2 * kCollisionMargin;

/// A cube of 0.2 m with sensors, and another that stands 1 m to its north and hangs on a beam
/// without a shape. `sensors` goes into the first.
std::shared_ptr<const model::Model> TwoCubes(const std::string& sensors) {
  const std::string text =
      "module EYE:\npoint c: coords=(0,.2,0), normal=(0,1,0), connector, k=1\n"
      "link l: grouping=(c), hull=box(size=(.2,.2,.2)), mass=1\n"
      "axis x: origin=(0,0,0), direction=(1,0,0)\n" +
      sensors +
      "module WALL:\npoint d: coords=(-1,.2,0), normal=(0,-1,0), connector, k=2\n"
      "link w: grouping=(d), hull=box(size=(.2,.2,.2)), mass=1\n"
      "axis x: origin=(0,0,0), direction=(1,0,0)\n"
      "connection BEAM: members=(EYE a, WALL b), conditions=(a.point p coincident b.point q\n"
      "  and p antiparallel q and a.x parallel b.x)\n"
      "robot both: modules=(EYE e, WALL w), connections=((e.c,w.d))\n"
      "robot alone: modules=(EYE e)\n";
  const m3l::CompileOutput output = m3l::CompileText("cubes.m3l", text);
  EXPECT_TRUE(output.model) << source::Render(output.diagnostics, output.sources, false);
  return std::make_shared<const model::Model>(*output.model);
}

std::string Distance(const std::string& name, const std::string& direction,
                     const std::string& more = "") {
  return "sensor " + name + ": type=distance, link=l, origin=(0,0,0), direction=" + direction +
         ", range=3" + more + "\n";
}

std::vector<float> ValuesOf(bridge::SimulatedRobot* robot) {
  std::vector<morphbus::module_sensors_t> sensors;
  robot->Sense(&sensors);
  EXPECT_EQ(sensors[0].num_sensor_values, static_cast<int>(sensors[0].sensor_value.size()));
  return sensors[0].sensor_value;
}

std::unique_ptr<BulletRobot> Make(const std::shared_ptr<const model::Model>& model,
                                  const std::string& robot,
                                  const BulletRobotOptions& options = {}) {
  auto made = BulletRobot::Create(model, robot, options);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return std::move(*made);
}

TEST(ModuleSensors, DistancesAreThoseToOtherModulesAndTheGroundNeverToTheOwnLinks) {
  const auto model = TwoCubes(Distance("north", "(1,0,0)") + Distance("south", "(-1,0,0)") +
                              Distance("down", "(0,-1,0)") + Distance("slope", "(1,-1,0)"));
  const auto robot = Make(model, "both");
  const std::vector<float> values = ValuesOf(robot.get());
  ASSERT_EQ(values.size(), 4U);
  EXPECT_NEAR(values[0], 0.9, kSlack) << "from the middle to the near side of the other cube";
  EXPECT_EQ(values[1], 3.0F) << "nothing is there: the range";
  EXPECT_NEAR(values[2], 0.1, kSlack) << "half a side above the ground";
  EXPECT_NEAR(values[3], 0.1 * std::numbers::sqrt2, 2 * kSlack);
}

TEST(ModuleSensors, NoiseHasItsDeviationAndRepeatsWithItsSeed) {
  const auto model = TwoCubes(Distance("north", "(1,0,0)", ", noise=.05"));
  BulletRobotOptions options;
  options.noise_seed = 7;
  const auto robot = Make(model, "both", options);
  const auto again = Make(model, "both", options);
  options.noise_seed = 8;
  const auto other = Make(model, "both", options);
  double sum = 0, squares = 0;
  int differ = 0;
  constexpr int kTicks = 400;
  for (int i = 0; i < kTicks; ++i) {
    const float value = ValuesOf(robot.get())[0];
    EXPECT_EQ(value, ValuesOf(again.get())[0]);
    EXPECT_EQ(value, ValuesOf(robot.get())[0]) << "a second look in the same tick";
    differ += value != ValuesOf(other.get())[0] ? 1 : 0;
    sum += value;
    squares += value * value;
    robot->Advance();
    again->Advance();
    other->Advance();
  }
  const double mean = sum / kTicks;
  EXPECT_NEAR(mean, 0.9, 0.012);
  EXPECT_NEAR(std::sqrt(squares / kTicks - mean * mean), 0.05, 0.008);
  EXPECT_GT(differ, kTicks / 2);
}

TEST(ModuleSensors, ContactIsFeltOnTheSideThatIsTouchedAndWithinTheRange) {
  const std::string contact = ": type=contact, link=l, origin=(0,-.1,0), direction=";
  const auto model = TwoCubes("sensor foot" + contact + "(0,-1,0)\nsensor head" + contact +
                              "(0,1,0)\nsensor side" + contact + "(1,0,0)\nsensor near" + contact +
                              "(0,-1,0), range=.01\nsensor far" + contact + "(0,-1,0), range=.2\n");
  const auto robot = Make(model, "alone");
  for (const float value : ValuesOf(robot.get()))
    EXPECT_EQ(value, 0.0F) << "it has not come down yet";
  for (int i = 0; i < 25; ++i) robot->Advance();
  EXPECT_EQ(ValuesOf(robot.get()), (std::vector<float>{1, 0, 0, 0, 1}));
}

TEST(ModuleSensors, TiltPointsUpInTheLinksFrame) {
  const auto model = TwoCubes("sensor up: type=tilt, link=l, origin=(0,0,0), direction=(0,1,0)\n");
  const auto robot = Make(model, "alone");
  EXPECT_EQ(ValuesOf(robot.get()), (std::vector<float>{0, 1, 0}));
  // Knocked over, it lies on another side.
  ASSERT_TRUE(robot->Push("e", Eigen::Vector3d(40, 0, 0), "", 0.3));
  for (int i = 0; i < 60; ++i) {
    robot->Advance();
    const Eigen::Vector3d up =
        robot->LinkPose(0, 0).linear().transpose() * Eigen::Vector3d::UnitY();
    const std::vector<float> values = ValuesOf(robot.get());
    ASSERT_EQ(values.size(), 3U);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(values[k], up(k), 1e-6);
  }
}

TEST(ModuleSensors, RobotsWithoutPhysicsSeeNothingAndKnowWhereUpIs) {
  const auto model =
      TwoCubes(Distance("north", "(1,0,0)") +
               "sensor up: type=tilt, link=l, origin=(0,0,0), direction=(0,1,0)\n"
               "sensor skin: type=contact, link=l, origin=(0,0,0), direction=(1,0,0)\n");
  auto robot = StillRobot::Create(model, "both", 20000, 1000);
  ASSERT_TRUE(robot);
  EXPECT_EQ(ValuesOf(robot->get()), (std::vector<float>{3, 0, 1, 0, 0}));
}

TEST(ModuleSensors, ObstaclesAreSeenTouchedAndPartOfTheWorldsHash) {
  const auto model = TwoCubes(Distance("north", "(1,0,0)") + Distance("up", "(0,1,0)") +
                              Distance("east", "(0,0,1)") + Distance("west", "(0,0,-1)"));
  BulletRobotOptions options;
  const std::string bare = Make(model, "alone", options)->world_hash();
  const auto add = [&](world::Shape shape, const Eigen::Vector3d& p_W,
                       const Eigen::Vector3d& size) {
    world::Obstacle& obstacle = options.world.obstacles.emplace_back();
    obstacle.shape = shape;
    obstacle.X_WO.translation() = p_W;
    obstacle.size = size;
  };
  add(world::Shape::kBox, {0.6, 0.5, 0}, {0.2, 1, 1});
  add(world::Shape::kSphere, {0, 1.1, 0}, {0.3, 0, 0});
  add(world::Shape::kCylinder, {0, 0.1, 0.8}, {0.2, 1, 0});
  const auto robot = Make(model, "alone", options);
  EXPECT_NE(robot->world_hash(), bare);
  const std::vector<float> values = ValuesOf(robot.get());
  EXPECT_NEAR(values[0], 0.5, kSlack);
  EXPECT_NEAR(values[1], 0.7, kSlack) << "the robot stands 0.1 m above the ground";
  EXPECT_NEAR(values[2], 0.3, kSlack)
      << "the cylinder stands along z of its frame, which is z here";
  EXPECT_EQ(values[3], 3.0F);
  // Pushed north, the cube stops at the box: a half side before its near face.
  ASSERT_TRUE(robot->Push("e", Eigen::Vector3d(20, 0, 0), "", 1.0));
  for (int i = 0; i < 100; ++i) robot->Advance();
  EXPECT_NEAR(robot->LinkPose(0, 0).translation().x(), 0.4, 0.01);
}

/// A robot of one cube of 0.2 m, above a surface alone; it falls and comes to rest.
struct Fallen {
  std::string hash;
  double down = 0;  ///< What it saw below before it fell (m, from its middle).
  model::Pose X_WL;
};
Fallen FallOn(const std::shared_ptr<const world::TriangleMesh>& mesh, const model::Pose& X_WO) {
  const auto model = TwoCubes(Distance("down", "(0,-1,0)"));
  BulletRobotOptions options;
  options.world.ground = false;
  world::Obstacle& obstacle = options.world.obstacles.emplace_back();
  obstacle.shape = world::Shape::kMesh;
  obstacle.mesh = mesh;
  obstacle.X_WO = X_WO;
  const auto robot = Make(model, "alone", options);
  Fallen fallen{robot->world_hash(), ValuesOf(robot.get())[0], {}};
  for (int i = 0; i < 100; ++i) robot->Advance();
  fallen.X_WL = robot->LinkPose(0, 0);
  return fallen;
}

TEST(ModuleSensors, ACubeRestsOnASlopeMadeOfAMeshAndOnOneOfAHeightMap) {
  // Both rise by 0.4 m over 4 m to the north, and are 0.2 m below the cube's middle, (0, 0.1, 0).
  const world::TriangleMesh slope = {{{-2, -0.3, 2}, {2, 0.1, 2}, {2, 0.1, -2}, {-2, -0.3, -2}},
                                     {{0, 1, 2}, {0, 2, 3}}};
  const world::TriangleMesh map =
      world::MeshOf({5, 5, {0,     16384, 32768, 49151, 65535, 0,     16384, 32768, 49151,
                            65535, 0,     16384, 32768, 49151, 65535, 0,     16384, 32768,
                            49151, 65535, 0,     16384, 32768, 49151, 65535}},
                    {4, 4, 0.4}, {0, 0, -0.3});
  model::Pose X_WZ = model::Pose::Identity();
  X_WZ.linear() << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  const Eigen::Vector3d normal = Eigen::Vector3d(-0.1, 1, 0).normalized();
  std::set<std::string> hashes;
  for (const auto& [mesh, X_WO] :
       {std::pair(slope, model::Pose::Identity()), std::pair(map, X_WZ)}) {
    const auto shared = std::make_shared<const world::TriangleMesh>(mesh);
    const Fallen fallen = FallOn(shared, X_WO);
    EXPECT_NEAR(fallen.down, 0.2, kSlack);
    const Eigen::Vector3d middle = fallen.X_WL.translation();
    EXPECT_NEAR((middle - Eigen::Vector3d(0, -0.1, 0)).dot(normal), 0.1, 0.002);
    EXPECT_LT(std::hypot(middle.x(), middle.z()), 0.1) << "it holds by friction";
    EXPECT_GT(fallen.X_WL.linear().col(1).dot(normal), 0.9999);
    // Alike again, to the bit.
    EXPECT_EQ(FallOn(shared, X_WO).X_WL.matrix(), fallen.X_WL.matrix());
    hashes.insert(fallen.hash);
  }
  // The hash knows each corner.
  world::TriangleMesh other = slope;
  other.points[0].y() -= 1e-9;
  hashes.insert(
      FallOn(std::make_shared<const world::TriangleMesh>(other), model::Pose::Identity()).hash);
  EXPECT_EQ(hashes.size(), 3U);
}

TEST(ModuleSensors, AMeshIsItsTrianglesAndNotTheirHull) {
  // A valley 1 m wide between two crests beside the cube: its bottom is 0.6 m below the middle.
  const world::TriangleMesh valley = {
      {{-0.5, 0.2, 2}, {-0.5, 0.2, -2}, {0, -0.5, 2}, {0, -0.5, -2}, {0.5, 0.2, 2}, {0.5, 0.2, -2}},
      {{0, 2, 1}, {2, 3, 1}, {2, 4, 3}, {4, 5, 3}}};
  const Fallen fallen = FallOn(std::make_shared<const world::TriangleMesh>(valley),
                               model::Pose(Eigen::Translation3d(0.01, 0, 0)));
  EXPECT_NEAR(fallen.down, 0.6 - 0.014, kSlack);
  EXPECT_LT(fallen.X_WL.translation().y(), 0.0) << "it fell into the valley";
}

}  // namespace
}  // namespace morphbus::sim
