#include "vm/space/bodies.h"
#include "vm/image/kinematics_verifier.h"

#include <gtest/gtest.h>

#include "compiler/model/kinematic_graph.h"
#include "test/support/toy_model.h"
#include "test/support/vm_robot.h"
#include "vm/run/context.h"

namespace morphbus::vm {
namespace {

using test::VmRobot;
using test::VmRobotOptions;

/// Compares degrees and adjacency of every link and joint with the kinematic graph of `robot`.
void ExpectGraph(VmRobot& vms, const model::Model& model, const model::Robot& robot) {
  const model::KinematicGraph graph = model::BuildKinematicGraph(model, robot);
  // Contexts need the images; the harness keeps them, so they are encoded once more here.
  for (int m = 0; m < vms.size(); ++m) {
    std::string error;
    const std::vector<uint8_t> bytes =
        EncodeKinematics(test::TablesOf(model, robot.modules[static_cast<size_t>(m)].type), &error);
    VerifiedKinematics kinematics;
    ASSERT_EQ(
        VerifyKinematics(bytes.data(), static_cast<uint32_t>(bytes.size()), &kinematics).message,
        nullptr);
    const VmConfig config;
    Context context{config, kinematics, vms.program(), vms.state(m)};
    for (int i = 0; i < kinematics.num_links(); ++i) {
      const int body = graph.body_of[static_cast<size_t>(m)][static_cast<size_t>(i)];
      EXPECT_EQ(DegreeOf(context, i), graph.bodies[static_cast<size_t>(body)].degree)
          << "module " << m << " link " << i;
    }
    for (const model::GraphJoint& joint : graph.joints) {
      if (joint.module != m) continue;
      EXPECT_EQ(AdjacentOf(context, joint.joint), static_cast<int>(joint.adjacent.size()))
          << "module " << m << " joint " << joint.joint;
    }
  }
}

model::Robot Without(model::Robot robot, const std::vector<int>& dockings) {
  for (auto it = dockings.rbegin(); it != dockings.rend(); ++it) {
    robot.dockings.erase(robot.dockings.begin() + *it);
  }
  return robot;
}

class BodiesTest : public ::testing::TestWithParam<uint64_t> {
 protected:
  const model::Model model_ = test::ToyModel();
};

TEST_P(BodiesTest, DegreesAndAdjacencyAreThoseOfTheKinematicGraph) {
  const model::Robot robot = test::RandomRobot(model_, 14, 8, GetParam());
  VmRobot vms(model_, robot, test::EmptyProgram());
  vms.Tick(test::BodyDiameterOf(model_, robot) + 1);
  ExpectGraph(vms, model_, robot);
  EXPECT_TRUE(vms.faults().empty());
}

TEST_P(BodiesTest, WhatIsGoneClearsWithinDiameterPlusOneTicks) {
  const model::Robot robot = test::RandomRobot(model_, 14, 8, GetParam());
  VmRobot vms(model_, robot, test::EmptyProgram());
  vms.Tick(20);
  std::vector<int> cut;
  for (size_t d = 0; d < robot.dockings.size(); ++d) {
    if ((d + GetParam()) % 3 != 0) continue;
    cut.push_back(static_cast<int>(d));
    vms.SetDocked(static_cast<int>(d), false);
  }
  vms.Tick(test::BodyDiameterOf(model_, robot) + 1);
  ExpectGraph(vms, model_, Without(robot, cut));
  for (const int d : cut) vms.SetDocked(d, true);
  // A mate's message names a new docking one tick after the sensors have seen it.
  vms.Tick(test::BodyDiameterOf(model_, robot) + 1);
  ExpectGraph(vms, model_, robot);
}

TEST_P(BodiesTest, JointsOfASilentModuleAreForgotten) {
  const model::Robot robot = test::RandomRobot(model_, 10, 5, GetParam());
  VmRobot vms(model_, robot, test::EmptyProgram());
  vms.Tick(20);
  vms.SetSilent(3, true);
  vms.Tick(12);
  for (int m = 0; m < vms.size(); ++m) {
    if (m == 3) continue;
    for (const BodyTable& table : vms.state(m).bodies) {
      for (int i = 0; i < table.num; ++i) {
        EXPECT_FALSE(table.records[i].module == 4 && table.records[i].live != 0);
      }
    }
  }
}

TEST_P(BodiesTest, WithGraceLossesDoNotShake) {
  const model::Robot robot = test::RandomRobot(model_, 10, 5, GetParam());
  VmRobotOptions options;
  options.loss = 0.3;
  options.late = 0.2;
  options.grace_ticks = 25;
  options.seed = GetParam();
  VmRobot vms(model_, robot, test::EmptyProgram(), options);
  vms.Tick(100);
  for (int i = 0; i < 100; ++i) {
    vms.Tick();
    if (i % 10 == 0) ExpectGraph(vms, model_, robot);
  }
}

TEST_P(BodiesTest, MemoryOfJointsThatAreGoneIsBounded) {
  const model::Robot robot = test::RandomRobot(model_, 14, 8, GetParam());
  VmRobot vms(model_, robot, test::EmptyProgram());
  vms.Tick(20);
  for (size_t d = 0; d < robot.dockings.size(); ++d) vms.SetDocked(static_cast<int>(d), false);
  vms.Tick(static_cast<int>(kBodyMemoryTicks) + 20);
  for (int m = 0; m < vms.size(); ++m) {
    for (const BodyTable& table : vms.state(m).bodies) EXPECT_LE(table.num, 2);
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, BodiesTest, ::testing::Range(uint64_t{1}, uint64_t{9}));

/// Modules in a row on one body: each of them adds a joint to it.
model::Robot Comb(const model::Model& model, int modules) {
  model::Robot robot = test::ChainRobot(model, modules);
  // c0 and c1 are both on link one, so the whole row hangs together by its links one.
  for (model::Docking& docking : robot.dockings) {
    for (size_t o = 0; o < model.connection_types[0].options.size(); ++o) {
      const model::ConnectionOption& option = model.connection_types[0].options[o];
      if (option.connector_a != 1 || option.connector_b != 0) continue;
      docking.connector_a = 1;
      docking.connector_b = 0;
      docking.option = static_cast<int>(o);
    }
  }
  return robot;
}

TEST(BodiesCapacityTest, ABodyTooLargeForOneMessageIsToldInTurns) {
  const model::Model model = test::ToyModel();
  const model::Robot robot = Comb(model, 60);
  VmRobot vms(model, robot, test::EmptyProgram());
  vms.Tick(400);
  ExpectGraph(vms, model, robot);
  EXPECT_EQ(vms.output(30).message.body_turns, 2);
  EXPECT_EQ(vms.CountFaults(FaultCode::kTooManyBodyJoints), 0);
  // Once known, it stays known.
  for (int i = 0; i < 20; ++i) {
    vms.Tick();
    for (int m = 0; m < 60; ++m) {
      int live = 0;
      const BodyTable& table = vms.state(m).bodies[0];
      for (int k = 0; k < table.num; ++k) live += table.records[k].live;
      ASSERT_EQ(live, 60) << "module " << m;
    }
  }
}

TEST(BodiesCapacityTest, ABodyBeyondTheCapacityIsAFaultToldOnce) {
  const model::Model model = test::ToyModel();
  const model::Robot robot = Comb(model, 70);
  VmRobot vms(model, robot, test::EmptyProgram());
  vms.Tick(600);
  EXPECT_GT(vms.CountFaults(FaultCode::kTooManyBodyJoints), 0);
  EXPECT_LT(vms.CountFaults(FaultCode::kTooManyBodyJoints), 70 * 40);
}

}  // namespace
}  // namespace morphbus::vm
