// Exported MJCF as MuJoCo loads it: link poses, masses, and loops that close where ours do.

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <cstring>
#include <map>
#include <memory>
#include <random>

#include "compiler/emit/mjcf.h"
#include "test/compiler/emit/exported_robots.h"

namespace morphbus::emit {
namespace {

using test::ExportCase;

struct Simulation {
  std::unique_ptr<mjModel, void (*)(mjModel*)> model{nullptr, mj_deleteModel};
  std::unique_ptr<mjData, void (*)(mjData*)> data{nullptr, mj_deleteData};
};

Simulation Load(const std::string& xml) {
  mjVFS files;
  mj_defaultVFS(&files);
  mj_makeEmptyFileVFS(&files, "robot.xml", static_cast<int>(xml.size()));
  std::memcpy(files.filedata[0], xml.data(), xml.size());
  char error[500] = "";
  Simulation simulation;
  simulation.model.reset(mj_loadXML("robot.xml", &files, error, sizeof error));
  mj_deleteVFS(&files);
  EXPECT_NE(simulation.model, nullptr) << error << "\n" << xml;
  EXPECT_STREQ(error, "");
  if (simulation.model) simulation.data.reset(mj_makeData(simulation.model.get()));
  return simulation;
}

double& Position(const Simulation& simulation, const std::string& joint) {
  const int id = mj_name2id(simulation.model.get(), mjOBJ_JOINT, joint.c_str());
  EXPECT_GE(id, 0) << joint;
  return simulation.data->qpos[simulation.model->jnt_qposadr[id]];
}

/// Largest violation of an equality constraint at the present state.
double Residual(const Simulation& simulation) {
  double residual = 0.0;
  for (int i = 0; i < simulation.data->nefc; ++i) {
    if (simulation.data->efc_type[i] != mjCNSTR_EQUALITY) continue;
    residual = std::max(residual, std::abs(simulation.data->efc_pos[i]));
  }
  return residual;
}

/// Joints that no tree joint moves are set too: they are the ones that close loops.
void SetValues(const ExportCase& robot, const model::JointValues& q, const Simulation& simulation) {
  for (size_t m = 0; m < q.size(); ++m) {
    const model::ModuleType& type = robot.model.TypeOf(robot.robot, static_cast<int>(m));
    for (size_t j = 0; j < q[m].size(); ++j) {
      if (type.joints[j].type == model::JointType::kFixed) continue;
      Position(simulation, robot.robot.modules[m].name + "." + type.joints[j].name) = q[m][j];
    }
  }
}

void ExpectSamePoses(const ExportCase& robot, const model::JointValues& q,
                     const Simulation& simulation) {
  SetValues(robot, q, simulation);
  mj_forward(simulation.model.get(), simulation.data.get());
  const model::KinematicState state = model::ForwardKinematics(robot.model, robot.robot, q);
  for (size_t m = 0; m < state.X_RL.size(); ++m) {
    for (size_t l = 0; l < state.X_RL[m].size(); ++l) {
      const std::string name = LinkName(robot, m, l);
      const int body = mj_name2id(simulation.model.get(), mjOBJ_BODY, name.c_str());
      ASSERT_GE(body, 0) << name;
      using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
      const Eigen::Map<const Eigen::Vector3d> p(simulation.data->xpos + 3 * body);
      const Eigen::Map<const RowMajor> R(simulation.data->xmat + 9 * body);
      const model::Pose X_WL = RobotFrameInZUp() * state.X_RL[m][l];
      EXPECT_LT((p - X_WL.translation()).norm(), 1e-9) << name;
      EXPECT_LT((R - X_WL.linear()).norm(), 1e-9) << name;
    }
  }
}

TEST(Mjcf, MuJoCoPlacesEveryLinkWhereTheModelDoes) {
  std::mt19937 random(2);
  for (const ExportCase& robot : test::ExportCases(20)) {
    SCOPED_TRACE(robot.name);
    const Simulation simulation = Load(ToMjcf(robot.model, TreeOf(robot.model, robot.robot)).text);
    ASSERT_NE(simulation.model, nullptr);
    for (int round = 0; round < 3; ++round) {
      ExpectSamePoses(robot, test::RandomValues(robot, random), simulation);
    }
  }
}

TEST(Mjcf, LoopsOfTheModelsCloseAtTheStart) {
  for (const ExportCase& robot : test::ExportCases(0)) {
    if (robot.name == "gadgets") continue;  // Its loop does not close at its start values.
    SCOPED_TRACE(robot.name);
    const RobotTree tree = TreeOf(robot.model, robot.robot);
    const Simulation simulation = Load(ToMjcf(robot.model, tree).text);
    ASSERT_NE(simulation.model, nullptr);
    EXPECT_EQ(simulation.model->neq, static_cast<int>(tree.loops.size()));
    mj_resetDataKeyframe(simulation.model.get(), simulation.data.get(), 0);
    mj_forward(simulation.model.get(), simulation.data.get());
    EXPECT_LT(Residual(simulation), 1e-6);
  }
}

TEST(Mjcf, LoopsOpenWhereAJointMovesAlone) {
  for (const ExportCase& robot : test::ExportCases(0)) {
    if (robot.name != "quadruped" && robot.name != "equivalent") continue;
    const Simulation simulation = Load(ToMjcf(robot.model, TreeOf(robot.model, robot.robot)).text);
    ASSERT_NE(simulation.model, nullptr);
    EXPECT_EQ(simulation.model->neq, 2);
    ASSERT_EQ(simulation.model->nkey, 1);
    mj_resetDataKeyframe(simulation.model.get(), simulation.data.get(), 0);
    mj_forward(simulation.model.get(), simulation.data.get());
    EXPECT_LT(Residual(simulation), 1e-9);
    Position(simulation, "m5.joint_1") += 0.1;
    mj_forward(simulation.model.get(), simulation.data.get());
    EXPECT_GT(Residual(simulation), 1e-3);
  }
}

// The joint that closes a loop inside a module keeps its own freedom: the loop is closed wherever
// the tree's joints and that joint agree.
TEST(Mjcf, AJointThatClosesALoopStillMoves) {
  const model::Model model = test::GadgetModel();
  model::Robot one = ModuleAsRobot(model, 0);
  one.modules[0].name = "g";
  const RobotTree tree = TreeOf(model, one);
  ASSERT_EQ(tree.loops.size(), 1u);
  const std::string& closing = tree.loops[0].name;
  const Simulation simulation = Load(ToMjcf(model, tree).text);
  ASSERT_NE(simulation.model, nullptr);
  mj_forward(simulation.model.get(), simulation.data.get());
  EXPECT_LT(Residual(simulation), 1e-9);
  Position(simulation, closing) = 0.4;
  mj_forward(simulation.model.get(), simulation.data.get());
  EXPECT_GT(Residual(simulation), 1e-3);
  // The poses of the two links that it joins, by MuJoCo, differ by just that motion.
  const auto& loop = tree.loops[0];
  const int body = mj_name2id(simulation.model.get(), mjOBJ_BODY, (closing + ".loop").c_str());
  ASSERT_GE(body, 0);
  const Eigen::Map<const Eigen::Vector3d> p(simulation.data->xpos + 3 * body);
  const model::Pose X = RobotFrameInZUp() * StartPoses(tree)[static_cast<size_t>(loop.from)] *
                        MotionOf(tree.joints[static_cast<size_t>(loop.joint)], 0.4);
  EXPECT_LT((p - X.translation()).norm(), 1e-9);
}

TEST(Mjcf, TheRobotHasItsMassAndStandsOnTheFloor) {
  for (const ExportCase& robot : test::ExportCases(0)) {
    if (robot.name != "quadruped" && robot.name != "equivalent") continue;
    const RobotTree tree = TreeOf(robot.model, robot.robot);
    const Simulation simulation = Load(ToMjcf(robot.model, tree).text);
    ASSERT_NE(simulation.model, nullptr);
    double mass = 0.0;
    for (const TreeLink& link : tree.links) {
      mass += model::ComputeLinkMass(robot.model.module_types[0], link.link).mass_kg;
    }
    EXPECT_NEAR(mj_getTotalmass(simulation.model.get()), mass, 1e-9);
    mj_resetDataKeyframe(simulation.model.get(), simulation.data.get(), 0);
    for (int step = 0; step < 500; ++step) mj_step(simulation.model.get(), simulation.data.get());
    const int trunk = mj_name2id(simulation.model.get(), mjOBJ_BODY, "m5.passive_block");
    const double fallen =
        simulation.data->xpos[3 * trunk + 2] - StartPoses(tree)[0].translation().y();
    EXPECT_LT(std::abs(fallen), 0.02) << robot.name;
    EXPECT_LT(Residual(simulation), 2e-3);
  }
}

}  // namespace
}  // namespace morphbus::emit
