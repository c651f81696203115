#include "sim/bullet_robot.h"

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

std::unique_ptr<BulletRobot> Make(const std::string& robot, const BulletRobotOptions& options) {
  auto made = BulletRobot::Create(test::MtranModel(), robot, options);
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
morphbus::docked_connector_t ReadingAt(BulletRobot* bullet_robot, int module, int connector) {
  Sensors sensors;
  bullet_robot->Sense(&sensors);
  for (const auto& docked : sensors[module].docked) {
    if (docked.connector == connector) return docked;
  }
  return {};
}

BulletRobotOptions FreeSpace() {
  BulletRobotOptions options;
  options.world.ground = false;
  options.world.gravity = false;
  return options;
}

TEST(BulletRobotTest, UnusableOptionsAreRefusedInASentence) {
  const auto model = test::MtranModel();
  EXPECT_FALSE(BulletRobot::Create(model, "centipede", {}));
  BulletRobotOptions options;
  options.tick_us = 20500;
  EXPECT_FALSE(BulletRobot::Create(model, "quadruped", options));
  options = {};
  options.physics_step_us = 0;
  EXPECT_FALSE(BulletRobot::Create(model, "quadruped", options));
  options = {};
  options.world.solver_iterations = 5;
  EXPECT_FALSE(BulletRobot::Create(model, "quadruped", options));
  options = {};
  options.world.friction = std::nan("");
  const auto bad = BulletRobot::Create(model, "quadruped", options);
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().message, "friction must lie between 0 and 10");
}

TEST(BulletRobotTest, ModulesAreSensedInOrderWithTheirJointsAtStart) {
  const auto bullet_robot = Make("quadruped", {});
  Sensors sensors;
  bullet_robot->Sense(&sensors);
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

TEST(BulletRobotTest, EachSideReadsTheNumberForWhichItIsMemberA) {
  const auto bullet_robot = Make("quadruped", {});
  const auto number = [&](int module, int connector) {
    return static_cast<int>(ReadingAt(bullet_robot.get(), module - 1, connector - 1).number);
  };
  EXPECT_EQ(number(2, 2), 53);  // (m2.c2,m3.c5): the default of (c2,c5)
  EXPECT_EQ(number(3, 5), 17);  // and of (c5,c2)
  EXPECT_EQ(number(3, 6), 3);   // (m3.c6,m5.c3,3)
  EXPECT_EQ(number(5, 3), 39);  // the third of (c3,c6)
  EXPECT_EQ(number(8, 4), 35);  // (m8.c4,m5.c1,35)
  EXPECT_EQ(number(5, 1), 71);  // the third of (c1,c4)
  const auto reading = ReadingAt(bullet_robot.get(), 4, 0);
  EXPECT_EQ(reading.mate_module, 7);
  EXPECT_EQ(reading.mate_connector, 3);
  EXPECT_EQ(reading.connection_type, 0);
}

TEST(BulletRobotTest, TruthIsTheFirstLinkOfEveryBody) {
  const auto bullet_robot = Make("quadruped", {});
  std::vector<morphbus::body_pose_t> truth;
  bullet_robot->Truth(&truth);
  ASSERT_EQ(truth.size(), 18u);  // m5's bar, though it is locked to the hub, is a body
  const LinkPoseTable X_WL = PlaceOnGround(bullet_robot->model(), bullet_robot->robot());
  for (const morphbus::body_pose_t& body : truth) {
    const Pose& X = X_WL[body.module_id][body.link];
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(body.position_m[k], X.translation()(k), 1e-9);
    const Eigen::Quaterniond q(body.orientation_wxyz[0], body.orientation_wxyz[1],
                               body.orientation_wxyz[2], body.orientation_wxyz[3]);
    EXPECT_TRUE(q.toRotationMatrix().isApprox(X.linear(), 1e-9));
  }
}

TEST(BulletRobotTest, LinkPosesAgreeWithForwardKinematicsAtTheSensedAngles) {
  for (const char* robot : {"quadruped", "equivalent_quadruped"}) {
    const auto bullet_robot = Make(robot, FreeSpace());
    for (int tick = 0; tick < 50; ++tick) {
      for (int m = 0; m < 9; ++m) {
        if (m != 4) bullet_robot->Actuate(MoveTo(m, 0.1 * (m + 1), 0.5 - 0.1 * m));
      }
      bullet_robot->Advance();
    }
    const model::JointValues q = bullet_robot->Positions();
    EXPECT_NEAR(q[0][0], 0.1, 1e-3);
    EXPECT_NEAR(q[8][1], -0.3, 1e-3);
    const auto X_RL =
        model::ForwardKinematics(bullet_robot->model(), bullet_robot->robot(), q).X_RL;
    const LinkPoseTable X_WL = bullet_robot->LinkPoses();
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

TEST(BulletRobotTest, SensedVelocityIsTheRateOfTheSensedPosition) {
  const auto bullet_robot = Make("quadruped", FreeSpace());
  for (int tick = 0; tick < 5; ++tick) {
    bullet_robot->Actuate(MoveTo(0, 1.0, -1.0));
    bullet_robot->Advance();
  }
  Sensors before;
  bullet_robot->Sense(&before);
  bullet_robot->Advance();
  Sensors after;
  bullet_robot->Sense(&after);
  for (size_t j = 0; j < 2; ++j) {
    const double rate = (after[0].joint_position_si[j] - before[0].joint_position_si[j]) / 0.02;
    EXPECT_NEAR(static_cast<double>(after[0].joint_velocity_si[j]), rate, 0.1);
    EXPECT_NEAR(std::abs(rate), std::numbers::pi, 0.1);
  }
}

TEST(BulletRobotTest, CommandsOfUnknownModulesAndJointsAreIgnored) {
  const auto bullet_robot = Make("quadruped", {});
  morphbus::actuator_t command = Hold(77);
  bullet_robot->Actuate(command);
  command = Hold(0);
  command.num_joints = 9;
  command.joints.resize(9, command.joints[0]);
  command.num_connectors = 2;
  command.connectors.resize(2);
  command.connectors[0] = {};
  command.connectors[0].connector = 100;
  command.connectors[1].connector = 1;
  command.connectors[1].state = 50;
  bullet_robot->Actuate(command);
  bullet_robot->Advance();
  EXPECT_EQ(bullet_robot->robot().dockings.size(), 10u);
}

TEST(BulletRobotTest, DisconnectingTakesBothReadingsAndFreesTheBar) {
  const auto bullet_robot = Make("quadruped", {});
  const std::string hash = bullet_robot->world_hash();
  ASSERT_TRUE(bullet_robot->Disconnect("m2", "c3"));
  EXPECT_EQ(ReadingAt(bullet_robot.get(), 1, 2).number, 0);
  EXPECT_EQ(ReadingAt(bullet_robot.get(), 4, 3).number, 0);
  // m5's passive block now hangs on m7 and m8 only, its active block too: still one body.
  EXPECT_EQ(bullet_robot->world().rigid_bodies().bodies.size(), 17u);
  ASSERT_TRUE(bullet_robot->Disconnect("m5", "c6"));
  // The passive block is free: hub, passive block and bar are three.
  EXPECT_EQ(bullet_robot->world().rigid_bodies().bodies.size(), 19u);
  EXPECT_EQ(bullet_robot->world_hash(), hash);
  EXPECT_FALSE(bullet_robot->Disconnect("m5", "c6"));
  EXPECT_FALSE(bullet_robot->Disconnect("m5", "c9"));
  EXPECT_FALSE(bullet_robot->Disconnect("m55", "c1"));
}

TEST(BulletRobotTest, WhatComesApartKeepsItsMotion) {
  BulletRobotOptions options;
  options.world.ground = false;
  const auto bullet_robot = Make("quadruped", options);
  const auto hub_state = [&] {
    const World& world = bullet_robot->world();
    return world.body(world.rigid_bodies().body_of[4][0]);
  };
  for (int tick = 0; tick < 10; ++tick) {
    bullet_robot->Actuate(MoveTo(0, 1.0, 1.0));
    bullet_robot->Advance();
  }
  const double speed = hub_state().v_WBo_W.y();
  const LinkPoseTable before = bullet_robot->LinkPoses();
  const model::JointValues q = bullet_robot->Positions();
  ASSERT_TRUE(bullet_robot->Disconnect("m1", "c2"));
  EXPECT_NEAR(hub_state().v_WBo_W.y(), speed, 1e-9);
  const LinkPoseTable after = bullet_robot->LinkPoses();
  for (size_t m = 0; m < 9; ++m) {
    for (size_t l = 0; l < 3; ++l) {
      EXPECT_LT((before[m][l].matrix() - after[m][l].matrix()).cwiseAbs().maxCoeff(), 1e-8);
    }
    for (size_t j = 0; j < 2; ++j) EXPECT_NEAR(bullet_robot->Positions()[m][j], q[m][j], 1e-12);
  }
}

TEST(BulletRobotTest, ConnectJoinsWhatIsNearAndRefusesWhatIsNot) {
  const auto bullet_robot = Make("quadruped", {});
  const int number = ReadingAt(bullet_robot.get(), 0, 1).number;
  ASSERT_TRUE(bullet_robot->Disconnect("m1", "c2"));
  EXPECT_FALSE(bullet_robot->Connect("m1", "c5"));  // a foot in the air
  ASSERT_TRUE(bullet_robot->Connect("m2", "c5"));   // from the other end
  EXPECT_EQ(ReadingAt(bullet_robot.get(), 0, 1).number, number);
  EXPECT_FALSE(bullet_robot->Connect("m1", "c2"));  // taken
  EXPECT_EQ(bullet_robot->world().rigid_bodies().bodies.size(), 17u);
}

TEST(BulletRobotTest, RetractingAHookUndocksAndExtendingItDocks) {
  const auto bullet_robot = Make("quadruped", {});
  bullet_robot->Actuate(SetState(0, 1, 0));
  bullet_robot->Advance();
  EXPECT_EQ(ReadingAt(bullet_robot.get(), 0, 1).number, 0);
  EXPECT_EQ(bullet_robot->robot().dockings.size(), 9u);
  bullet_robot->Actuate(SetState(0, 1, 1));
  bullet_robot->Advance();
  EXPECT_EQ(ReadingAt(bullet_robot.get(), 0, 1).number, 53);
}

TEST(BulletRobotTest, HoweverManyHooksMoveInATickTheWorldIsMadeAnewOnce) {
  const auto bullet_robot = Make("quadruped", {});
  const auto set_all = [&](int value) {
    for (int module = 0; module < 9; ++module) {
      for (int connector = 0; connector < 3; ++connector) {
        bullet_robot->Actuate(SetState(module, connector, value));
      }
    }
  };
  const size_t connections = bullet_robot->robot().dockings.size();
  ASSERT_GT(connections, 5u);
  set_all(0);
  bullet_robot->Advance();
  EXPECT_LT(bullet_robot->robot().dockings.size(), connections - 5);
  EXPECT_EQ(bullet_robot->rebuilds(), 1);
  set_all(1);
  bullet_robot->Advance();
  EXPECT_GT(bullet_robot->robot().dockings.size(), connections - 3);
  EXPECT_EQ(bullet_robot->rebuilds(), 2);
}

TEST(BulletRobotTest, WhatOpensAndClosesWithinATickLeavesTheWorldAsItIs) {
  const auto bullet_robot = Make("quadruped", {});
  bullet_robot->Actuate(SetState(0, 1, 0));
  bullet_robot->Actuate(SetState(0, 1, 1));
  bullet_robot->Advance();
  EXPECT_EQ(ReadingAt(bullet_robot.get(), 0, 1).number, 53);
  EXPECT_EQ(bullet_robot->rebuilds(), 0);
}

/// How far the foot's joint of a module has gone half a second after the module was lost, which had
/// raised it by 0.8 rad; the module type is changed to `on_loss`.
double SagAfterLoss(model::OnLoss on_loss) {
  auto model = std::make_shared<model::Model>(*test::MtranModel());
  for (model::ModuleType& type : model->module_types) type.on_loss = on_loss;
  auto made = BulletRobot::Create(model, "quadruped", BulletRobotOptions());
  EXPECT_TRUE(made);
  BulletRobot& robot = **made;
  const auto angle = [&robot] { return robot.Positions()[0][0]; };
  for (int tick = 0; tick < 40; ++tick) {
    robot.Actuate(MoveTo(0, 0.8, 0));
    robot.Advance();
  }
  EXPECT_NEAR(angle(), 0.8, 0.05);
  robot.Lose(0);
  for (int tick = 0; tick < 25; ++tick) {
    // Whatever still claims to command it is not heard.
    robot.Actuate(MoveTo(0, -0.8, 0));
    robot.Advance();
    // A world that is made anew remembers it.
    if (tick == 10) {
      EXPECT_TRUE(robot.Disconnect("m2", "c3"));
    }
  }
  return std::abs(angle() - 0.8);
}

TEST(BulletRobotTest, ALostModulesJointsGoLimpOrHoldAsItsTypeSays) {
  EXPECT_LT(SagAfterLoss(model::OnLoss::kHold), 0.05);
  EXPECT_GT(SagAfterLoss(model::OnLoss::kLimp), 0.2);
}

TEST(BulletRobotTest, PushMovesTheBodyForOneTick) {
  const auto bullet_robot = Make("quadruped", FreeSpace());
  ASSERT_TRUE(bullet_robot->Push("m5", {0, 0, 37.8}));
  bullet_robot->Advance();
  bullet_robot->Advance();
  Vector3d momentum = Vector3d::Zero();
  const World& world = bullet_robot->world();
  for (size_t b = 0; b < world.rigid_bodies().bodies.size(); ++b) {
    momentum += world.rigid_bodies().bodies[b].mass_kg * world.body(static_cast<int>(b)).v_WBo_W;
  }
  EXPECT_NEAR((momentum - Vector3d(0, 0, 37.8 * 0.02)).norm(), 0.0, 1e-9);
  EXPECT_FALSE(bullet_robot->Push("m99", {1, 0, 0}));
  EXPECT_FALSE(bullet_robot->Push("m5", {std::nan(""), 0, 0}));
  // How strong a push may be is checked where a command is read.
  EXPECT_TRUE(bullet_robot->Push("m5", {20000, 0, 0}));
}

}  // namespace
}  // namespace morphbus::sim
