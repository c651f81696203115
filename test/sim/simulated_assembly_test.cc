#include "sim/simulated_assembly.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "compiler/model/forward_kinematics.h"
#include "test/sim/mtran.h"
#include "test/sim/toy_robots.h"

namespace morphbus::sim {
namespace {

using Eigen::Vector3d;
using Sensors = std::vector<morphbus::module_sensors_t>;

std::unique_ptr<SimulatedAssembly> Make(const std::string& robot, const AssemblyOptions& options) {
  auto made = SimulatedAssembly::Create(test::MakeMtranModel(), robot, options);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return std::move(*made);
}

morphbus::actuator_t Hold(int module) {
  morphbus::actuator_t command;
  command.module_id = static_cast<int16_t>(module);
  command.num_joints = 2;
  command.joints.resize(2);
  for (morphbus::joint_command_t& joint : command.joints) {
    joint.mode = morphbus::joint_command_t::MODE_HOLD;
    joint.target_si = 0.0;
    joint.speed_si = 0.0;
  }
  command.num_connectors = 0;
  return command;
}

morphbus::actuator_t MoveTo(int module, double joint_1, double joint_2) {
  morphbus::actuator_t command = Hold(module);
  const double targets[2] = {joint_1, joint_2};
  for (size_t j = 0; j < 2; ++j) {
    command.joints[j].mode = morphbus::joint_command_t::MODE_POSITION;
    command.joints[j].target_si = targets[j];
    command.joints[j].speed_si = std::numbers::pi;
  }
  return command;
}

morphbus::actuator_t SetState(int module, int connector, int value) {
  morphbus::actuator_t command = Hold(module);
  command.num_connectors = 1;
  command.connectors.resize(1);
  command.connectors[0].connector = static_cast<int8_t>(connector);
  command.connectors[0].state = 0;
  command.connectors[0].value = static_cast<int8_t>(value);
  return command;
}

// What `module` reads at `connector`; number 0 if nothing is there.
morphbus::docked_connector_t ReadingAt(SimulatedAssembly* assembly, int module, int connector) {
  Sensors sensors;
  assembly->Sense(&sensors);
  for (const auto& docked : sensors[static_cast<size_t>(module)].docked) {
    if (docked.connector == connector) return docked;
  }
  return {};
}

AssemblyOptions FreeSpace() {
  AssemblyOptions options;
  options.world.ground = false;
  options.world.gravity = false;
  return options;
}

TEST(SimulatedAssemblyTest, UnusableOptionsAreRefusedInASentence) {
  const auto model = test::MakeMtranModel();
  EXPECT_FALSE(SimulatedAssembly::Create(model, "centipede", {}));
  AssemblyOptions options;
  options.tick_us = 20500;
  EXPECT_FALSE(SimulatedAssembly::Create(model, "quadruped", options));
  options = {};
  options.physics_step_us = 0;
  EXPECT_FALSE(SimulatedAssembly::Create(model, "quadruped", options));
  options = {};
  options.world.solver_iterations = 5;
  EXPECT_FALSE(SimulatedAssembly::Create(model, "quadruped", options));
  options = {};
  options.world.friction = std::nan("");
  const auto bad = SimulatedAssembly::Create(model, "quadruped", options);
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().message, "friction must lie between 0 and 10");
}

TEST(SimulatedAssemblyTest, ModulesAreSensedInOrderWithTheirJointsAtStart) {
  const auto assembly = Make("quadruped", {});
  Sensors sensors;
  assembly->Sense(&sensors);
  ASSERT_EQ(sensors.size(), 9u);
  for (size_t m = 0; m < 9; ++m) {
    EXPECT_EQ(sensors[m].module_id, static_cast<int>(m));
    EXPECT_EQ(sensors[m].name, "m" + std::to_string(m + 1));
    EXPECT_EQ(sensors[m].joint_position_si, (std::vector<double>{0.0, 0.0}));
    EXPECT_EQ(sensors[m].num_docked, static_cast<int>(sensors[m].docked.size()));
  }
  // Fig. 5: the junction has four neighbours, upper halves three, lower halves one.
  const int neighbours[9] = {1, 3, 3, 1, 4, 1, 3, 3, 1};
  for (size_t m = 0; m < 9; ++m) EXPECT_EQ(sensors[m].num_docked, neighbours[m]);
}

TEST(SimulatedAssemblyTest, EachSideReadsTheNumberForWhichItIsMemberA) {
  const auto assembly = Make("quadruped", {});
  const auto number = [&](int module, int connector) {
    return static_cast<int>(ReadingAt(assembly.get(), module - 1, connector - 1).number);
  };
  EXPECT_EQ(number(2, 2), 53);  // (m2.c2,m3.c5): the default of (c2,c5)
  EXPECT_EQ(number(3, 5), 17);  // and of (c5,c2)
  EXPECT_EQ(number(3, 6), 3);   // (m3.c6,m5.c3,3)
  EXPECT_EQ(number(5, 3), 39);  // the third of (c3,c6)
  EXPECT_EQ(number(8, 4), 35);  // (m8.c4,m5.c1,35)
  EXPECT_EQ(number(5, 1), 71);  // the third of (c1,c4)
  const auto reading = ReadingAt(assembly.get(), 4, 0);
  EXPECT_EQ(reading.mate_module, 7);
  EXPECT_EQ(reading.mate_connector, 3);
  EXPECT_EQ(reading.connection_type, 0);
}

TEST(SimulatedAssemblyTest, TruthIsTheFirstLinkOfEveryBody) {
  const auto assembly = Make("quadruped", {});
  std::vector<morphbus::body_pose_t> truth;
  assembly->Truth(&truth);
  ASSERT_EQ(truth.size(), 18u);  // m5's bar, though it is locked to the hub, is a body
  const LinkPoseTable X_WL = PlaceOnGround(assembly->model(), assembly->robot());
  for (const morphbus::body_pose_t& body : truth) {
    const Pose& X = X_WL[static_cast<size_t>(body.module_id)][static_cast<size_t>(body.link)];
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(body.position_m[k], X.translation()(k), 1e-9);
    const Eigen::Quaterniond q(body.orientation_wxyz[0], body.orientation_wxyz[1],
                               body.orientation_wxyz[2], body.orientation_wxyz[3]);
    EXPECT_TRUE(q.toRotationMatrix().isApprox(X.linear(), 1e-9));
  }
}

TEST(SimulatedAssemblyTest, LinkPosesAgreeWithForwardKinematicsAtTheSensedAngles) {
  for (const char* robot : {"quadruped", "equivalent_quadruped"}) {
    const auto assembly = Make(robot, FreeSpace());
    for (int tick = 0; tick < 50; ++tick) {
      for (int m = 0; m < 9; ++m) {
        if (m != 4) assembly->Actuate(MoveTo(m, 0.1 * (m + 1), 0.5 - 0.1 * m));
      }
      assembly->Advance();
    }
    const model::JointValues q = assembly->Positions();
    EXPECT_NEAR(q[0][0], 0.1, 1e-3);
    EXPECT_NEAR(q[8][1], -0.3, 1e-3);
    const auto X_RL = model::ForwardKinematics(assembly->model(), assembly->robot(), q).X_RL;
    const LinkPoseTable X_WL = assembly->LinkPoses();
    const Pose X_WR = X_WL[4][1] * X_RL[4][1].inverse();
    for (size_t m = 0; m < 9; ++m) {
      for (size_t l = 0; l < 3; ++l) {
        const Pose X = X_WR * X_RL[m][l];
        EXPECT_NEAR((X.translation() - X_WL[m][l].translation()).norm(), 0.0, 1e-3);
        EXPECT_TRUE(X.linear().isApprox(X_WL[m][l].linear(), 5e-3));
      }
    }
  }
}

TEST(SimulatedAssemblyTest, SensedVelocityIsTheRateOfTheSensedPosition) {
  const auto assembly = Make("quadruped", FreeSpace());
  for (int tick = 0; tick < 5; ++tick) {
    assembly->Actuate(MoveTo(0, 1.0, -1.0));
    assembly->Advance();
  }
  Sensors before;
  assembly->Sense(&before);
  assembly->Advance();
  Sensors after;
  assembly->Sense(&after);
  for (size_t j = 0; j < 2; ++j) {
    const double rate = (after[0].joint_position_si[j] - before[0].joint_position_si[j]) / 0.02;
    EXPECT_NEAR(static_cast<double>(after[0].joint_velocity_si[j]), rate, 0.1);
    EXPECT_NEAR(std::abs(rate), std::numbers::pi, 0.1);
  }
}

TEST(SimulatedAssemblyTest, CommandsOfUnknownModulesAndJointsAreIgnored) {
  const auto assembly = Make("quadruped", {});
  morphbus::actuator_t command = Hold(77);
  assembly->Actuate(command);
  command = Hold(0);
  command.num_joints = 9;
  command.joints.resize(9, command.joints[0]);
  command.num_connectors = 2;
  command.connectors.resize(2);
  command.connectors[0] = {};
  command.connectors[0].connector = 100;
  command.connectors[1].connector = 1;
  command.connectors[1].state = 50;
  assembly->Actuate(command);
  assembly->Advance();
  EXPECT_EQ(assembly->robot().dockings.size(), 10u);
}

TEST(SimulatedAssemblyTest, DisconnectingTakesBothReadingsAndFreesTheBar) {
  const auto assembly = Make("quadruped", {});
  const std::string hash = assembly->world_hash();
  ASSERT_TRUE(assembly->Disconnect("m2", "c3"));
  EXPECT_EQ(ReadingAt(assembly.get(), 1, 2).number, 0);
  EXPECT_EQ(ReadingAt(assembly.get(), 4, 3).number, 0);
  // m5's passive block now hangs on m7 and m8 only, its active block too: still one body.
  EXPECT_EQ(assembly->world().assembly().bodies.size(), 17u);
  ASSERT_TRUE(assembly->Disconnect("m5", "c6"));
  // The passive block is free: hub, passive block and bar are three.
  EXPECT_EQ(assembly->world().assembly().bodies.size(), 19u);
  EXPECT_EQ(assembly->world_hash(), hash);
  EXPECT_FALSE(assembly->Disconnect("m5", "c6"));
  EXPECT_FALSE(assembly->Disconnect("m5", "c9"));
  EXPECT_FALSE(assembly->Disconnect("m55", "c1"));
}

TEST(SimulatedAssemblyTest, WhatComesApartKeepsItsMotion) {
  AssemblyOptions options;
  options.world.ground = false;
  const auto assembly = Make("quadruped", options);
  const auto hub_state = [&] {
    const World& world = assembly->world();
    return world.body(world.assembly().body_of[4][0]);
  };
  for (int tick = 0; tick < 10; ++tick) {
    assembly->Actuate(MoveTo(0, 1.0, 1.0));
    assembly->Advance();
  }
  const double speed = hub_state().v_WBo_W.y();
  const LinkPoseTable before = assembly->LinkPoses();
  const model::JointValues q = assembly->Positions();
  ASSERT_TRUE(assembly->Disconnect("m1", "c2"));
  EXPECT_NEAR(hub_state().v_WBo_W.y(), speed, 1e-9);
  const LinkPoseTable after = assembly->LinkPoses();
  for (size_t m = 0; m < 9; ++m) {
    for (size_t l = 0; l < 3; ++l) {
      EXPECT_LT((before[m][l].matrix() - after[m][l].matrix()).cwiseAbs().maxCoeff(), 1e-8);
    }
    for (size_t j = 0; j < 2; ++j) EXPECT_NEAR(assembly->Positions()[m][j], q[m][j], 1e-12);
  }
}

TEST(SimulatedAssemblyTest, ConnectJoinsWhatIsNearAndRefusesWhatIsNot) {
  const auto assembly = Make("quadruped", {});
  const int number = ReadingAt(assembly.get(), 0, 1).number;
  ASSERT_TRUE(assembly->Disconnect("m1", "c2"));
  EXPECT_FALSE(assembly->Connect("m1", "c5"));  // a foot in the air
  ASSERT_TRUE(assembly->Connect("m2", "c5"));   // from the other end
  EXPECT_EQ(ReadingAt(assembly.get(), 0, 1).number, number);
  EXPECT_FALSE(assembly->Connect("m1", "c2"));  // taken
  EXPECT_EQ(assembly->world().assembly().bodies.size(), 17u);
}

TEST(SimulatedAssemblyTest, RetractingAHookUndocksAndExtendingItDocks) {
  const auto assembly = Make("quadruped", {});
  assembly->Actuate(SetState(0, 1, 0));
  assembly->Advance();
  EXPECT_EQ(ReadingAt(assembly.get(), 0, 1).number, 0);
  EXPECT_EQ(assembly->robot().dockings.size(), 9u);
  assembly->Actuate(SetState(0, 1, 1));
  assembly->Advance();
  EXPECT_EQ(ReadingAt(assembly.get(), 0, 1).number, 53);
}

TEST(SimulatedAssemblyTest, PushMovesTheBodyForOneTick) {
  const auto assembly = Make("quadruped", FreeSpace());
  ASSERT_TRUE(assembly->Push("m5", {0, 0, 37.8}));
  assembly->Advance();
  assembly->Advance();
  Vector3d momentum = Vector3d::Zero();
  const World& world = assembly->world();
  for (size_t b = 0; b < world.assembly().bodies.size(); ++b) {
    momentum += world.assembly().bodies[b].mass_kg * world.body(static_cast<int>(b)).v_WBo_W;
  }
  EXPECT_NEAR((momentum - Vector3d(0, 0, 37.8 * 0.02)).norm(), 0.0, 1e-9);
  EXPECT_FALSE(assembly->Push("m99", {1, 0, 0}));
  EXPECT_FALSE(assembly->Push("m5", {std::nan(""), 0, 0}));
}

}  // namespace
}  // namespace morphbus::sim
