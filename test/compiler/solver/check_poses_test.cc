#include "compiler/solver/check_poses.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "test/support/shipped_models.h"
#include "test/support/source_dir.h"

namespace morphbus::solver {
namespace {

using Eigen::Vector3d;

/// The middle of the corners of a link, in R.
Vector3d Middle(const model::Link& link, const model::Pose& X_RL) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& p : link.hull) sum += X_RL * p;
  return sum / static_cast<double>(link.hull.size());
}

/// The robot with one connection made in another way.
model::Robot WithWay(model::Robot robot, int docking, int number) {
  robot.dockings[docking].option = number - 1;
  return robot;
}

TEST(CheckPosesTest, PosesOfShippedRobotsAreWithinLimitsAndCloseTheirLoops) {
  for (const auto& [file, model] : test::ShippedModels()) {
    for (const model::Robot& robot : model.robots) {
      SCOPED_TRACE(file + " " + robot.name);
      const CheckPoses found = FindCheckPoses(model, robot, model::PlanAssembly(model, robot));
      ASSERT_FALSE(found.poses.empty());
      EXPECT_EQ(found.poses.front().q, model::StartValues(robot));
      for (const CheckPose& pose : found.poses) {
        const model::KinematicState state = model::ForwardKinematics(model, robot, pose.q);
        EXPECT_LT(state.closure_m, 1e-6);
        EXPECT_LT(state.closure_rad, 1e-6);
        for (int m = 0; m < std::ssize(robot.modules); ++m) {
          const model::ModuleType& type = model.TypeOf(robot, m);
          for (size_t j = 0; j < type.joints.size(); ++j) {
            EXPECT_GE(pose.q[m][j], type.joints[j].lower - 1e-4);
            EXPECT_LE(pose.q[m][j], type.joints[j].upper + 1e-4);
          }
        }
      }
    }
  }
}

TEST(CheckPosesTest, WhatAPoseTellsApartLiesElsewhereByForwardKinematics) {
  int told = 0, alike = 0;
  for (const auto& [file, model] : test::ShippedModels()) {
    for (const model::Robot& robot : model.robots) {
      SCOPED_TRACE(file + " " + robot.name);
      const model::AssemblyPlan plan = model::PlanAssembly(model, robot);
      const CheckPoses found = FindCheckPoses(model, robot, plan);
      int in_loops = 0;
      for (const CheckPose& pose : found.poses) {
        std::set<std::pair<int, int>> not_told;
        for (const AlikeWay& way : pose.alike) not_told.insert({way.added, way.number});
        int ways = 0;
        in_loops = 0;
        for (int i = 1; i < std::ssize(plan.modules); ++i) {
          for (const model::Mating& mating : plan.modules[i].matings) {
            for (const int number : mating.ways) {
              if (number == mating.number) continue;
              const model::KinematicState wrong =
                  model::ForwardKinematics(model, WithWay(robot, mating.docking, number), pose.q);
              // A connection in a loop: the wrong way leaves it open.
              if (wrong.closure_m > 1e-6 || wrong.closure_rad > 1e-6) {
                ++in_loops;
                continue;
              }
              ++ways;
              double shift = 0.0;
              for (int m = 0; m < std::ssize(robot.modules); ++m) {
                const auto& links = model.TypeOf(robot, m).links;
                for (size_t l = 0; l < links.size(); ++l) {
                  if (links[l].hull.empty()) continue;
                  shift = std::max(shift, (Middle(links[l], wrong.X_RL[m][l]) -
                                           Middle(links[l], pose.X_RL[m][l]))
                                              .norm());
                }
              }
              EXPECT_EQ(shift < pose.least_shift_m - 1e-9, not_told.contains({i, number}))
                  << robot.modules[plan.modules[i].module].name << " " << number << ": " << shift;
              (shift > pose.least_shift_m - 1e-9 ? told : alike) += 1;
            }
          }
        }
        EXPECT_EQ(pose.num_other_ways, ways);
        EXPECT_EQ(found.num_ways_in_loops, in_loops);
      }
    }
  }
  EXPECT_GT(told, 100);
  EXPECT_GT(alike, 10);
}

TEST(CheckPosesTest, TheBentPoseTellsMoreThanTheStart) {
  // All joints of the quadruped are at 0 at the start: a leg that is put on upside down looks the
  // same. Bent it does not.
  const auto models = test::ShippedModels();
  const model::Model& model = models.at("mtran.m3l");
  const model::Robot& robot = *model.FindRobot("quadruped");
  const CheckPoses found = FindCheckPoses(model, robot, model::PlanAssembly(model, robot));
  ASSERT_EQ(found.poses.size(), 2u);
  EXPECT_EQ(found.poses[1].kind, CheckPose::Kind::kBent);
  EXPECT_FALSE(found.poses[0].alike.empty());
  EXPECT_TRUE(found.poses[1].alike.empty());
  // m5's joints are held by the legs, all others are bent.
  for (int m = 0; m < std::ssize(robot.modules); ++m) {
    for (const double q : found.poses[1].q[m]) EXPECT_EQ(q != 0.0, robot.modules[m].name != "m5");
  }
}

TEST(CheckPosesTest, WhatIsLeftOutIsSaid) {
  // Every joint of the ring is in its loop, which does not close at 0.
  const auto models = test::ShippedModels();
  const model::Model& model = models.at("mtran_robots.m3l");
  const model::Robot& robot = *model.FindRobot("caterpillar");
  const CheckPoses found = FindCheckPoses(model, robot, model::PlanAssembly(model, robot));
  EXPECT_EQ(found.poses.size(), 1u);
  EXPECT_EQ(found.left_out,
            (std::vector<std::string>{
                "All joints at 0 is no pose of this robot: its loops do not close there.",
                "There is no bent pose: no joint moves by itself, outside of loops."}));
  EXPECT_EQ(found.num_ways_in_loops, 8 * 3);
  EXPECT_EQ(found.num_loops, 1);
}

TEST(CheckPosesTest, ALongRobotIsBentWithoutRunningIntoItself) {
  // A row of 30: bent all one way it would be a ring after twelve joints.
  std::string modules, connections;
  for (int m = 1; m <= 30; ++m) {
    modules += (m > 1 ? ", MTRAN m" : "MTRAN m") + std::to_string(m);
    if (m == 1) continue;
    connections += (m > 2 ? ", (m" : "(m") + std::to_string(m - 1) + ".c2, m" + std::to_string(m) +
                   ".c5, rot=180)";
  }
  const model::Model model = test::DirectedModel(
      test::SourcePath("models/row.m3l"), "import \"mtran.m3l\"\nrobot row: modules=(" + modules +
                                              "), connections=(" + connections + ")\n");
  const model::Robot& robot = *model.FindRobot("row");
  const CheckPoses found = FindCheckPoses(model, robot, model::PlanAssembly(model, robot));
  ASSERT_EQ(found.poses.size(), 2u);
  // Modules that are not neighbours stay further apart than they are wide.
  const auto& X_RL = found.poses[1].X_RL;
  for (size_t a = 0; a < X_RL.size(); ++a) {
    for (size_t b = a + 2; b < X_RL.size(); ++b) {
      EXPECT_GT((X_RL[a][2].translation() - X_RL[b][2].translation()).norm(), 0.065);
    }
  }
}

}  // namespace
}  // namespace morphbus::solver
