#include "sim/rigid_body_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "compiler/model/forward_kinematics.h"
#include "test/sim/mtran.h"

namespace morphbus::sim {
namespace {

using Eigen::Vector3d;

RigidBodyModel Build(const model::Model& model, const model::Robot& robot) {
  return BuildRigidBodyModel(model, robot, ComputeLinkPhysics(model, robot),
                             PlaceOnGround(model, robot), model::StartValues(robot));
}

class RigidBodyModelTest : public ::testing::Test {
 protected:
  RigidBodyModelTest() : model_(test::MtranModel()) {}

  const model::Robot& robot(int index) const { return model_->robots[index]; }

  std::shared_ptr<const model::Model> model_;
};

// The robot with its modules in another order and every docking written from the other end.
model::Robot Renumbered(const model::Model& model, const model::Robot& robot,
                        const std::vector<int>& order) {
  std::vector<int> place(order.size());
  model::Robot out = robot;
  for (size_t i = 0; i < order.size(); ++i) {
    out.modules[i] = robot.modules[order[i]];
    place[order[i]] = static_cast<int>(i);
  }
  out.root_module = place[robot.root_module];
  std::reverse(out.dockings.begin(), out.dockings.end());
  for (model::Docking& d : out.dockings) {
    d.option = model::MirrorOption(model, d).value();
    std::swap(d.module_a, d.module_b);
    std::swap(d.connector_a, d.connector_b);
    d.module_a = place[d.module_a];
    d.module_b = place[d.module_b];
  }
  return out;
}

TEST_F(RigidBodyModelTest, QuadrupedHasItsBarsLegsAndOneHub) {
  const RigidBodyModel rigid_bodies = Build(*model_, robot(0));
  // 18 bodies of the kinematic graph, of which the locked bar of m5 is part of the hub.
  EXPECT_EQ(rigid_bodies.bodies.size(), 17u);
  EXPECT_EQ(rigid_bodies.joints.size(), 18u);
  EXPECT_EQ(rigid_bodies.body_of[4][0], rigid_bodies.body_of[4][2]);
  double mass = 0.0;
  for (const BodySpec& body : rigid_bodies.bodies) mass += body.mass_kg;
  EXPECT_NEAR(mass, 9 * 0.42, 1e-12);
  const BodySpec& hub = rigid_bodies.bodies[rigid_bodies.body_of[4][0]];
  EXPECT_NEAR(hub.mass_kg, 6 * 0.18 + 0.06, 1e-12);
  EXPECT_EQ(hub.links.size(), 7u);
}

TEST_F(RigidBodyModelTest, RobotStandsHalfAMillimetreAboveTheGroundUnderItsFrame) {
  const LinkPoseTable X_WL = PlaceOnGround(*model_, robot(0));
  double lowest = 1.0;
  for (size_t m = 0; m < X_WL.size(); ++m) {
    for (size_t l = 0; l < X_WL[m].size(); ++l) {
      for (const Vector3d& p : model_->module_types[0].links[l].hull) {
        lowest = std::min(lowest, (X_WL[m][l] * p).y());
      }
    }
  }
  EXPECT_NEAR(lowest, 0.0005, 1e-9);
  const Pose X_WR = X_WL[4][1] * robot(0).X_LR;
  EXPECT_NEAR(X_WR.translation().x(), 0.0, 1e-12);
  EXPECT_NEAR(X_WR.translation().z(), 0.0, 1e-12);
  EXPECT_TRUE(X_WR.linear().isIdentity(1e-12));
}

TEST_F(RigidBodyModelTest, BodyFramesAreParallelToTheWorldAtTheStart) {
  for (const BodySpec& body : Build(*model_, robot(0)).bodies) {
    EXPECT_EQ(body.X_WB.linear(), Eigen::Matrix3d::Identity());
  }
}

TEST_F(RigidBodyModelTest, CongruentRobotsAreTheSameNumbers) {
  const RigidBodyModel a = Build(*model_, robot(0));
  const RigidBodyModel b = Build(*model_, robot(1));
  EXPECT_EQ(HashRigidBodyModel(a, 0), HashRigidBodyModel(b, 0));
  ASSERT_EQ(a.bodies.size(), b.bodies.size());
  for (size_t i = 0; i < a.bodies.size(); ++i) {
    EXPECT_EQ(a.bodies[i].X_WB.matrix(), b.bodies[i].X_WB.matrix());
    EXPECT_EQ(a.bodies[i].inertia_B, b.bodies[i].inertia_B);
  }
}

TEST_F(RigidBodyModelTest, NumberingAndDirectionOfDockingsDoNotMatter) {
  model::Robot posed = robot(0);
  // Angles that are nobody's multiple of anything: rounding has to do real work.
  for (size_t m = 0; m < posed.modules.size(); ++m) {
    if (m == 4) continue;
    posed.modules[m].start = {0.3 + 0.01 * static_cast<double>(m), -0.7};
  }
  const RigidBodyModel a = Build(*model_, posed);
  const RigidBodyModel b = Build(*model_, Renumbered(*model_, posed, {8, 3, 5, 0, 4, 2, 7, 1, 6}));
  EXPECT_EQ(HashRigidBodyModel(a, 0), HashRigidBodyModel(b, 0));
}

TEST_F(RigidBodyModelTest, TurnedBodiesGetTheirPrincipalFrames) {
  model::Robot posed = robot(0);
  posed.modules[0].start = {0.4, 0.0};
  bool turned = false;
  for (const BodySpec& body : Build(*model_, posed).bodies) {
    EXPECT_NEAR(
        (body.X_WB.linear().transpose() * body.X_WB.linear() - Eigen::Matrix3d::Identity()).norm(),
        0.0, 1e-12);
    EXPECT_GT(body.X_WB.linear().trace(), 2.0);  // near the world's directions
    turned = turned || !body.X_WB.linear().isIdentity(1e-6);
  }
  EXPECT_TRUE(turned);
}

TEST_F(RigidBodyModelTest, UnlikeRobotsHashDifferently) {
  const uint64_t hash = HashRigidBodyModel(Build(*model_, robot(0)), 0);
  model::Robot posed = robot(0);
  posed.modules[0].start = {0.1, 0.0};
  EXPECT_NE(HashRigidBodyModel(Build(*model_, posed), 0), hash);
  model::Model heavier = *model_;
  heavier.module_types[0].links[1].mass_kg = 0.19;
  EXPECT_NE(HashRigidBodyModel(Build(heavier, heavier.robots[0]), 0), hash);
  model::Model slower = *model_;
  slower.module_types[0].joints[0].speed = 1.0;
  EXPECT_NE(HashRigidBodyModel(Build(slower, slower.robots[0]), 0), hash);
}

TEST_F(RigidBodyModelTest, BodiesUpToTwoJointsApartNeverCollide) {
  const RigidBodyModel rigid_bodies = Build(*model_, robot(0));
  // From the front left foot (m1's passive block) towards the hub.
  const int foot = rigid_bodies.body_of[0][1];
  const auto may_collide = [&](int module, int link) {
    return static_cast<bool>(rigid_bodies.may_collide[foot][rigid_bodies.body_of[module][link]]);
  };
  EXPECT_FALSE(may_collide(0, 1));  // itself
  EXPECT_FALSE(may_collide(0, 2));  // shin
  EXPECT_FALSE(may_collide(0, 0));  // knee
  EXPECT_TRUE(may_collide(1, 2));   // thigh's bar
  EXPECT_TRUE(may_collide(4, 0));   // hub
  EXPECT_TRUE(may_collide(3, 0));   // back left foot
}

TEST_F(RigidBodyModelTest, JointDirectionsAreCanonical) {
  for (const JointSpec& joint : Build(*model_, robot(0)).joints) {
    EXPECT_EQ(joint.axis_W, Vector3d::UnitZ());
    EXPECT_LE(joint.body_1, joint.body_2);
    EXPECT_NEAR(joint.lower, -std::numbers::pi / 2, 1e-12);
    EXPECT_NEAR(joint.upper, std::numbers::pi / 2, 1e-12);
  }
}

TEST_F(RigidBodyModelTest, RoundingNeverGivesMinusZero) {
  EXPECT_FALSE(std::signbit(RoundToNanometre(-1e-12)));
  EXPECT_EQ(RoundToNanometre(0.1234567894), 0.123456789);
}

}  // namespace
}  // namespace morphbus::sim
