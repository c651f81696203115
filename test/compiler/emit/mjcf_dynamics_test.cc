// Exported MJCF in motion: loops hold, drives carry loads, and no joint outruns its speed.

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>

#include "compiler/emit/back_ends.h"
#include "test/compiler/emit/exported_robots.h"
#include "test/compiler/emit/mujoco_robot.h"
#include "test/support/source_dir.h"

namespace morphbus::emit {
namespace {

using test::ExportCase;
using test::Simulation;

Simulation AtStart(const ExportCase& robot) {
  Simulation simulation =
      test::LoadInMuJoCo(ToMjcf(robot.model, TreeOf(robot.model, robot.robot), "robot"));
  if (simulation.model) test::GoToStart(simulation);
  return simulation;
}

/// Steps for so long (s), calling `seen` after each step.
template <typename Seen>
void StepFor(const Simulation& simulation, double seconds, Seen seen) {
  const double end = simulation.data->time + seconds;
  while (simulation.data->time < end) {
    mj_step(simulation.model.get(), simulation.data.get());
    seen();
  }
}

double& Control(const Simulation& simulation, const std::string& joint) {
  const int id = mj_name2id(simulation.model.get(), mjOBJ_ACTUATOR, joint.c_str());
  EXPECT_GE(id, 0) << joint;
  return simulation.data->ctrl[id];
}

TEST(MjcfDynamics, LoopsOfEveryModelStayClosed) {
  int loops = 0;
  for (const ExportCase& robot : test::ExportCases(0)) {
    if (robot.name == "gadgets") continue;  // Its loop does not close at its start values.
    SCOPED_TRACE(robot.name);
    const Simulation simulation = AtStart(robot);
    ASSERT_NE(simulation.model, nullptr);
    double worst = 0.0;
    StepFor(simulation, 3.0, [&] { worst = std::max(worst, test::Residual(simulation)); });
    EXPECT_LT(worst, 2e-3);
    for (int i = 0; i < mjNWARNING; ++i) EXPECT_EQ(simulation.data->warning[i].number, 0) << i;
    loops += simulation.model->neq;
  }
  EXPECT_GE(loops, 6);
}

TEST(MjcfDynamics, AFileOpensAtTheStartValues) {
  for (const ExportCase& robot : test::ExportCases(3)) {
    if (robot.name == "gadgets") continue;
    SCOPED_TRACE(robot.name);
    const RobotTree tree = TreeOf(robot.model, robot.robot);
    const Simulation simulation = test::LoadInMuJoCo(ToMjcf(robot.model, tree, "robot"));
    ASSERT_NE(simulation.model, nullptr);
    for (const TreeJoint& joint : tree.joints) {
      if (joint.type == model::JointType::kFixed) continue;
      EXPECT_NEAR(test::Position(simulation, joint.name), joint.start, 1e-12) << joint.name;
    }
    mj_forward(simulation.model.get(), simulation.data.get());
    EXPECT_LT(test::Residual(simulation), 1e-6);
    for (int i = 0; i < simulation.model->nq; ++i) {
      EXPECT_NEAR(simulation.data->qpos[i], simulation.model->key_qpos[i], 1e-12);
    }
  }
}

// A joint that closes a loop has a body of its own, whose mass comes off the link's.
TEST(MjcfDynamics, MassesAddUpToThoseDeclared) {
  int loops = 0;
  for (const ExportCase& robot : test::ExportCases(0)) {
    SCOPED_TRACE(robot.name);
    const RobotTree tree = TreeOf(robot.model, robot.robot);
    double declared = 0.0;  // kg
    for (const model::ModuleInstance& module : robot.robot.modules) {
      const auto type = static_cast<size_t>(module.type);
      for (const model::Link& link : robot.model.module_types[type].links) {
        declared += link.mass_kg;
      }
    }
    const Simulation simulation = test::LoadInMuJoCo(ToMjcf(robot.model, tree, "robot"));
    ASSERT_NE(simulation.model, nullptr);
    EXPECT_NEAR(mj_getTotalmass(simulation.model.get()), declared, 1e-9 * declared);
    for (const TreeLoop& loop : tree.loops) loops += loop.joint >= 0 ? 1 : 0;
  }
  EXPECT_GT(loops, 0);
}

// Steps of the command as large as the joints' ranges, with nothing in the way.
TEST(MjcfDynamics, JointsKeepTheirSpeed) {
  for (const ExportCase& robot : test::ExportCases(0)) {
    if (robot.name == "gadgets" || !TreeOf(robot.model, robot.robot).loops.empty()) continue;
    const RobotTree tree = TreeOf(robot.model, robot.robot);
    for (size_t j = 0; j < std::min<size_t>(tree.joints.size(), 4); ++j) {
      const TreeJoint& joint = tree.joints[j];
      if (joint.type == model::JointType::kFixed) continue;
      SCOPED_TRACE(robot.name + " " + joint.name);
      const Simulation simulation = AtStart(robot);
      ASSERT_NE(simulation.model, nullptr);
      simulation.model->opt.disableflags |= mjDSBL_CONTACT | mjDSBL_GRAVITY;
      const double goal = std::isfinite(joint.upper) ? joint.upper : joint.start + 3.0;
      Control(simulation, joint.name) = goal;
      const int id = mj_name2id(simulation.model.get(), mjOBJ_JOINT, joint.name.c_str());
      double fastest = 0.0;
      const double time = std::abs(goal - joint.start) / joint.speed;
      StepFor(simulation, 1.5 * time + 0.3, [&] {
        const double speed = simulation.data->qvel[simulation.model->jnt_dofadr[id]];
        fastest = std::max(fastest, std::abs(speed));
      });
      EXPECT_LT(fastest, 1.05 * joint.speed);
      const double error = std::abs(test::Position(simulation, joint.name) - goal);
      EXPECT_LT(error, 0.02 * std::abs(goal - joint.start) + 1e-4);
    }
  }
}

// A telescope on end, on one M-TRAN module and with three on top: 13.6 N for its drive of 100 N.
TEST(MjcfDynamics, ASlideHoldsAndLiftsItsLoad) {
  const ExportCase robot = test::CompiledCase(
      "import \"" + test::SourcePath("models/mixed.m3l") +
          "\"\n"
          "robot lift: modules=(TELESCOPE t, MTRAN a, MTRAN b, MTRAN c, MTRAN foot),\n"
          "  connections=((a.c2, t.head), (b.c2, a.c5), (c.c2, b.c5), (foot.c2, t.tail)),\n"
          "  frame=(t.tube.(axis: origin=(0, 0, 0), direction=(0, 0, -1)),\n"
          "         t.tube.(axis: origin=(0, 0, 0), direction=(1, 0, 0)),\n"
          "         t.tube.(axis: origin=(0, 0, 0), direction=(0, -1, 0))),\n"
          "  joints=(t.slide=1)\n",
      "lift");
  const Simulation simulation = AtStart(robot);
  ASSERT_NE(simulation.model, nullptr);
  const double start = test::Position(simulation, "t.slide");
  StepFor(simulation, 1.0, [] {});
  EXPECT_NEAR(test::Position(simulation, "t.slide"), start, 2e-4);
  Control(simulation, "t.slide") = start + 0.02;
  StepFor(simulation, 2.0, [] {});
  EXPECT_NEAR(test::Position(simulation, "t.slide"), start + 0.02, 2e-4);
}

}  // namespace
}  // namespace morphbus::emit
