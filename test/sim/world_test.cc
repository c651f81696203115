#include "sim/world.h"

#include <gtest/gtest.h>

#include <cmath>

#include "compiler/model/forward_kinematics.h"
#include "test/sim/mtran.h"
#include "test/sim/toy_robots.h"
#include "test/sim/world_contacts.h"

namespace morphbus::sim {
namespace {

using Eigen::Vector3d;

std::unique_ptr<World> MakeWorld(const model::Model& model, const WorldOptions& options) {
  const model::Robot& robot = model.robots[0];
  return std::make_unique<World>(
      BuildRigidBodyModel(model, robot, ComputeLinkPhysics(model, robot),
                          PlaceOnGround(model, robot), model::StartValues(robot)),
      options);
}

Vector3d CentreOfMass(const World& world) {
  Vector3d moment = Vector3d::Zero();
  double mass = 0.0;
  for (size_t b = 0; b < world.rigid_bodies().bodies.size(); ++b) {
    const double m = world.rigid_bodies().bodies[b].mass_kg;
    moment += m * world.body(static_cast<int>(b)).X_WB.translation();
    mass += m;
  }
  return moment / mass;
}

// About the centre of mass (kg m^2/s); `scale`: the sum of the magnitudes that went in.
Vector3d AngularMomentum(const World& world, double* scale) {
  const Vector3d centre = CentreOfMass(world);
  Vector3d total = Vector3d::Zero();
  *scale = 0.0;
  for (size_t b = 0; b < world.rigid_bodies().bodies.size(); ++b) {
    const BodySpec& spec = world.rigid_bodies().bodies[b];
    const BodyState state = world.body(static_cast<int>(b));
    const Eigen::Matrix3d R_WB = state.X_WB.linear();
    const Vector3d own =
        R_WB * spec.inertia_B.cwiseProduct(R_WB.transpose() * state.w_WB_W) +
        spec.mass_kg * (Vector3d(state.X_WB.translation()) - centre).cross(state.v_WBo_W);
    total += own;
    *scale += own.norm();
  }
  return total;
}

// Swings all of the quadruped's legs about, quickly and unevenly.
void ThrashAbout(World* world, int step) {
  for (size_t j = 0; j < world->rigid_bodies().joints.size(); ++j) {
    const double target = 1.2 * std::sin(0.004 * step * (1.0 + 0.1 * static_cast<double>(j)));
    world->Command(static_cast<int>(j), {ServoMode::kPosition, target, 3.0});
  }
}

TEST(WorldTest, InFreeFallTheCentreOfMassFallsWithGravityWhateverTheJointsDo) {
  WorldOptions options;
  options.ground = false;
  const auto model = test::MtranModel();
  const auto world = MakeWorld(*model, options);
  const Vector3d start = CentreOfMass(*world);
  for (int step = 1; step <= 1000; ++step) {
    ThrashAbout(world.get(), step);
    world->Step();
  }
  // The sum that the integrator forms: velocity first, then position.
  const double fall = test::kGravity * 1e-6 * 1000 * 1001 / 2;
  EXPECT_NEAR((CentreOfMass(*world) - start + Vector3d(0, fall, 0)).norm(), 0.0, 1e-9);
}

TEST(WorldTest, InFreeFallAngularMomentumStaysZeroWhateverTheJointsDo) {
  WorldOptions options;
  options.ground = false;
  options.gravity = false;
  const auto model = test::MtranModel();
  const auto world = MakeWorld(*model, options);
  double largest = 0.0;
  for (int step = 1; step <= 2000; ++step) {
    ThrashAbout(world.get(), step);
    world->Step();
    double scale = 0.0;
    const Vector3d momentum = AngularMomentum(*world, &scale);
    largest = std::max(largest, scale);
    ASSERT_LE(momentum.norm(), 0.01 * std::max(largest, 1e-3)) << "step " << step;
  }
  EXPECT_GT(largest, 0.05);  // there was something to conserve
}

TEST(WorldTest, MotorsStayWithinTheirTorque) {
  const auto model = test::MtranModel();
  const auto world = MakeWorld(*model, {});
  double largest = 0.0;
  for (int step = 1; step <= 3000; ++step) {
    ThrashAbout(world.get(), step);
    world->Step();
    for (size_t j = 0; j < world->rigid_bodies().joints.size(); ++j) {
      const double theta = world->joint(static_cast<int>(j)).theta;
      if (std::abs(theta) > 1.57) continue;  // at its mechanical stop
      largest = std::max(largest, std::abs(world->joint(static_cast<int>(j)).motor_effort));
    }
  }
  EXPECT_GT(largest, 1.0);
  EXPECT_LE(largest, 1.9 + 1e-6);
}

TEST(WorldTest, StartIsHardlyAFall) {
  const auto model = test::MtranModel();
  const auto world = MakeWorld(*model, {});
  const Vector3d start = CentreOfMass(*world);
  for (int step = 0; step < 500; ++step) world->Step();
  const Vector3d drop = CentreOfMass(*world) - start;
  EXPECT_NEAR(drop.y(), -0.0005, 0.0003);
  EXPECT_LT(std::hypot(drop.x(), drop.z()), 1e-4);
}

TEST(WorldTest, ARobotWithoutHullsHasNothingToStandOn) {
  model::Model model = *test::MakePair(model::JointType::kRevolute, 0.0);
  for (model::Link& link : model.module_types[0].links) link.hull.clear();
  const auto world = MakeWorld(model, {});
  for (int step = 0; step < 500; ++step) world->Step();
  EXPECT_LT(CentreOfMass(*world).y(), -1.0);
  EXPECT_TRUE(WorldContacts::Of(*world).empty());
}

TEST(WorldTest, WithoutGroundTheRobotFalls) {
  WorldOptions options;
  options.ground = false;
  const auto model = test::MakeBox();
  const auto world = MakeWorld(*model, options);
  for (int step = 0; step < 500; ++step) world->Step();
  EXPECT_LT(CentreOfMass(*world).y(), -1.0);
}

// How far a cube of 1 kg is shoved in half a second by a horizontal force.
double ShovedBy(double newtons, double friction) {
  WorldOptions options;
  options.friction = friction;
  const auto model = test::MakeBox();
  const auto world = MakeWorld(*model, options);
  for (int step = 0; step < 200; ++step) world->Step();
  const double start = CentreOfMass(*world).x();
  world->Push(0, {newtons, 0, 0}, 500);
  for (int step = 0; step < 500; ++step) world->Step();
  return CentreOfMass(*world).x() - start;
}

TEST(WorldTest, FrictionHoldsUpToItsCoefficient) {
  EXPECT_LT(ShovedBy(0.7 * test::kGravity, 0.8), 0.002);
  // What is left over after friction accelerates the cube: s = a t² / 2.
  EXPECT_NEAR(ShovedBy(1.3 * test::kGravity, 0.8), 0.5 * 0.5 * test::kGravity * 0.25, 0.05);
  EXPECT_NEAR(ShovedBy(0.5 * test::kGravity, 0.0), 0.5 * 0.5 * test::kGravity * 0.25, 0.02);
}

TEST(WorldTest, PushesEnd) {
  WorldOptions options;
  options.ground = false;
  options.gravity = false;
  const auto model = test::MakeBox();
  const auto world = MakeWorld(*model, options);
  world->Push(0, {2.0, 0, 0}, 100);
  for (int step = 0; step < 300; ++step) world->Step();
  EXPECT_NEAR(world->body(0).v_WBo_W.x(), 0.2, 1e-9);
}

TEST(WorldTest, TwoBuildsInOneProcessRunAlikeBitForBit) {
  const auto model = test::MtranModel();
  const auto first = MakeWorld(*model, {});
  for (int step = 1; step <= 500; ++step) {
    ThrashAbout(first.get(), step);
    first->Step();
  }
  const auto second = MakeWorld(*model, {});
  EXPECT_EQ(second->hash(), first->hash());
  for (int step = 1; step <= 500; ++step) {
    ThrashAbout(second.get(), step);
    second->Step();
  }
  for (int b = 0; b < 17; ++b) {
    EXPECT_EQ(first->body(b).X_WB.matrix(), second->body(b).X_WB.matrix());
    EXPECT_EQ(first->body(b).w_WB_W, second->body(b).w_WB_W);
  }
}

TEST(WorldTest, HashSaysWhichWorldWasBuilt) {
  const auto model = test::MtranModel();
  const std::string hash = MakeWorld(*model, {})->hash();
  EXPECT_EQ(hash.size(), 16u);
  EXPECT_EQ(hash.find_first_not_of("0123456789abcdef"), std::string::npos);
  WorldOptions options;
  options.friction = 0.7;
  EXPECT_NE(MakeWorld(*model, options)->hash(), hash);
  options = {};
  options.solver_iterations = 50;
  EXPECT_NE(MakeWorld(*model, options)->hash(), hash);
  options = {};
  options.ground = false;
  EXPECT_NE(MakeWorld(*model, options)->hash(), hash);
}

// Drives the pair's joint to `target` (its own value) in free space.
std::unique_ptr<World> DriveJoint(const model::Model& model, double target, int steps) {
  WorldOptions options;
  options.ground = false;
  options.gravity = false;
  auto world = MakeWorld(model, options);
  const JointSpec joint = world->rigid_bodies().joints[0];
  const double theta = joint.sign * (target - joint.start);
  world->Command(0, {ServoMode::kPosition, theta, 10.0});
  for (int step = 0; step < steps; ++step) world->Step();
  return world;
}

TEST(WorldTest, RevoluteJointReadsItsTrueAngleWithTheModelsSign) {
  for (const double start : {0.0, 0.3}) {
    const auto model = test::MakePair(model::JointType::kRevolute, start);
    const auto world = DriveJoint(*model, 0.7, 1000);
    const JointSpec& joint = world->rigid_bodies().joints[0];
    EXPECT_NEAR(joint.start + joint.sign * world->joint(0).theta, 0.7, 1e-4);
    const int a = world->rigid_bodies().body_of[0][0];
    const int b = world->rigid_bodies().body_of[0][1];
    // Driving by +q turns A relative to B about +z.
    const Eigen::AngleAxisd start_turn(start, Vector3d::UnitZ());
    const Eigen::Matrix3d R_BA =
        world->body(b).X_WB.linear().transpose() * world->rigid_bodies().bodies[b].X_WB.linear() *
        world->rigid_bodies().bodies[a].X_WB.linear().transpose() * world->body(a).X_WB.linear();
    EXPECT_TRUE(R_BA.isApprox(Eigen::AngleAxisd(0.7 - start, Vector3d::UnitZ()).matrix(), 1e-3));
  }
}

TEST(WorldTest, PrismaticJointSlidesAlongItsAxisWithinItsSpeedAndLimits) {
  const auto model = test::MakePair(model::JointType::kPrismatic, 0.0);
  const auto world = DriveJoint(*model, 0.03, 100);
  const JointSpec& joint = world->rigid_bodies().joints[0];
  EXPECT_NEAR(joint.sign * world->joint(0).theta, 0.02, 0.004);  // 0.2 m/s
  const auto arrived = DriveJoint(*model, 0.03, 1000);
  const Vector3d p_a = arrived->body(arrived->rigid_bodies().body_of[0][0]).X_WB.translation();
  const Vector3d p_b = arrived->body(arrived->rigid_bodies().body_of[0][1]).X_WB.translation();
  EXPECT_NEAR((p_a - p_b - Vector3d(-0.2 + 0.03, 0, 0)).norm(), 0.0, 1e-4);
  const auto clamped = DriveJoint(*model, 1.0, 1000);
  EXPECT_NEAR(joint.sign * clamped->joint(0).theta, 0.05, 1e-4);
}

TEST(WorldTest, ContinuousJointCountsFullTurns) {
  WorldOptions options;
  options.ground = false;
  options.gravity = false;
  const auto model = test::MakePair(model::JointType::kContinuous, 0.0);
  const auto world = MakeWorld(*model, options);
  world->Command(0, {ServoMode::kVelocity, 0.0, 1.5});
  for (int step = 0; step < 10000; ++step) world->Step();
  EXPECT_NEAR(world->joint(0).theta, 15.0, 0.1);
  EXPECT_NEAR(world->joint(0).rate, 1.5, 0.01);
}

TEST(WorldTest, JointsHoldTogetherAndTheLockedBarStaysPut) {
  const auto model = test::MtranModel();
  const auto world = MakeWorld(*model, {});
  double gap = 0.0;
  for (int step = 1; step <= 2000; ++step) {
    ThrashAbout(world.get(), step);
    world->Step();
    for (const JointSpec& joint : world->rigid_bodies().joints) {
      Vector3d p[2];
      const int bodies[2] = {joint.body_1, joint.body_2};
      for (int k = 0; k < 2; ++k) {
        const Pose& start = world->rigid_bodies().bodies[bodies[k]].X_WB;
        p[k] = world->body(bodies[k]).X_WB * start.inverse() * joint.p_WJ;
      }
      gap = std::max(gap, (p[0] - p[1]).norm());
    }
  }
  EXPECT_LT(gap, 1e-3);
  for (const int joint : world->rigid_bodies().joint_of[4]) {
    EXPECT_EQ(world->joint(joint).theta, 0.0);
  }
}

}  // namespace
}  // namespace morphbus::sim
