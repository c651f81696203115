#include "vm/space/spatial.h"

#include <gtest/gtest.h>

#include "compiler/model/forward_kinematics.h"
#include "test/support/toy_model.h"
#include "test/support/vm_robot.h"

namespace morphbus::vm {
namespace {

using test::VmRobot;
using test::VmRobotOptions;

constexpr double kTolerance = 1e-5;  // m, and 1 - |q.q'|.

double ErrorAgainst(const PoseF& actual, const model::Pose& expected) {
  const PoseF e = test::ToFloat(expected);
  const float dot =
      actual.q.w * e.q.w + actual.q.x * e.q.x + actual.q.y * e.q.y + actual.q.z * e.q.z;
  return std::max(Norm(Subtract(actual.p, e.p)), 1.0f - std::abs(dot));
}

/// Largest error over all links of the modules that the predicate names; infinite if one has none.
template <typename Predicate>
double LargestError(VmRobot& robot, const model::KinematicState& truth, Predicate counts) {
  double largest = 0;
  for (int m = 0; m < robot.size(); ++m) {
    if (!counts(m)) continue;
    if (!robot.state(m).pose.has) return INFINITY;
    const auto& links = truth.X_RL[static_cast<size_t>(m)];
    for (size_t i = 0; i < links.size(); ++i) {
      largest = std::max(largest, ErrorAgainst(robot.state(m).pose.X_RL[i], links[i]));
    }
  }
  return largest;
}

double LargestError(VmRobot& robot, const model::KinematicState& truth) {
  return LargestError(robot, truth, [](int) { return true; });
}

class SpatialTest : public ::testing::TestWithParam<uint64_t> {
 protected:
  const model::Model model_ = test::ToyModel();
};

/// Random values within each joint's limits.
void Scramble(const model::Model& model, VmRobot* robot, uint64_t seed) {
  const model::Robot other =
      test::RandomRobot(model, 3 * robot->size(), 0, seed);  // A source of start values.
  for (int m = 0; m < robot->size(); ++m) {
    for (const model::ModuleInstance& instance : other.modules) {
      if (instance.type != robot->robot().modules[static_cast<size_t>(m)].type) continue;
      robot->joints()[static_cast<size_t>(m)] = instance.start;
      break;
    }
  }
}

TEST_P(SpatialTest, PosesAreTheModelsWithinDiameterPlusOneTicks) {
  const model::Robot robot = test::RandomRobot(model_, 12, 0, GetParam());
  VmRobot vms(model_, robot, test::EmptyProgram());
  vms.Tick(test::DiameterOf(robot) + 1);
  EXPECT_LT(LargestError(vms, model::ForwardKinematics(model_, robot, vms.joints())), kTolerance);
}

TEST_P(SpatialTest, ChangedJointsAreKnownEverywhereWithinDiameterPlusOneTicks) {
  const model::Robot robot = test::RandomRobot(model_, 12, 0, GetParam());
  VmRobot vms(model_, robot, test::EmptyProgram());
  vms.Tick(20);
  // No program moves the joints: the targets are what was measured first, so the world has to be
  // moved by hand each tick.
  Scramble(model_, &vms, GetParam() + 100);
  const model::JointValues moved = vms.joints();
  for (int i = 0; i < test::DiameterOf(robot) + 1; ++i) {
    vms.joints() = moved;
    vms.Tick();
  }
  EXPECT_LT(LargestError(vms, model::ForwardKinematics(model_, robot, moved)), kTolerance);
}

TEST_P(SpatialTest, AnyModuleCanBeTheRoot) {
  const model::Robot robot = test::RandomRobot(model_, 8, 0, GetParam());
  for (int root = 0; root < 8; ++root) {
    VmRobotOptions options;
    options.root = root;
    VmRobot vms(model_, robot, test::EmptyProgram(), options);
    vms.Tick(test::DiameterOf(robot) + 1);
    EXPECT_LT(LargestError(vms, model::ForwardKinematics(model_, robot, vms.joints())), kTolerance)
        << "root " << root;
  }
}

TEST_P(SpatialTest, UnlikeNeighboursAreUnderstoodWithoutBeingToldWhoIsMemberB) {
  const model::Robot robot = test::RandomRobot(model_, 10, 0, GetParam());
  VmRobotOptions options;
  options.tells_member = false;
  VmRobot vms(model_, robot, test::EmptyProgram(), options);
  vms.Tick(test::DiameterOf(robot) + 1);
  EXPECT_LT(LargestError(vms, model::ForwardKinematics(model_, robot, vms.joints())), kTolerance);
}

TEST_P(SpatialTest, LossAndLateMessagesOnlyDelayPoses) {
  const model::Robot robot = test::RandomRobot(model_, 10, 0, GetParam());
  VmRobotOptions options;
  options.loss = 0.3;
  options.late = 0.3;
  options.seed = GetParam();
  VmRobot vms(model_, robot, test::EmptyProgram(), options);
  const model::KinematicState truth = model::ForwardKinematics(model_, robot, vms.joints());
  vms.Tick(200);
  EXPECT_LT(LargestError(vms, truth), kTolerance);
  // Sequences never go back.
  std::vector<int64_t> newest(10, -1);
  for (int i = 0; i < 100; ++i) {
    vms.Tick();
    for (int m = 0; m < 10; ++m) {
      EXPECT_GE(vms.state(m).pose.sequence, newest[static_cast<size_t>(m)]);
      newest[static_cast<size_t>(m)] = vms.state(m).pose.sequence;
    }
  }
}

TEST_P(SpatialTest, APartCutOffStopsHearingNewsAndAgesTogether) {
  const model::Robot robot = test::RandomRobot(model_, 12, 6, GetParam());
  VmRobot vms(model_, robot, test::EmptyProgram());
  vms.Tick(20);
  // Cut all dockings between the first half and the second.
  for (size_t d = 0; d < robot.dockings.size(); ++d) {
    const bool a = robot.dockings[d].module_a < 6, b = robot.dockings[d].module_b < 6;
    if (a != b) vms.SetDocked(static_cast<int>(d), false);
  }
  // What was known somewhere in the part may still spread in it, and no more.
  int64_t newest = 0;
  for (int m = 6; m < 12; ++m) newest = std::max(newest, vms.state(m).pose.sequence);
  vms.Tick(static_cast<int>(kPoseStaleTicks) + 14);
  for (int m = 6; m < 12; ++m) {
    EXPECT_LE(vms.state(m).pose.sequence, newest);
    EXPECT_TRUE(vms.state(m).pose.stale);
    EXPECT_TRUE(vms.output(m).message.pose_stale);
  }
  EXPECT_EQ(
      vms.CountFaults(FaultCode::kStalePose), 12 - 6 + [&] {
        int others = 0;  // Modules of the first half that hung on by way of the second.
        for (int m = 0; m < 6; ++m) others += vms.state(m).pose.stale ? 1 : 0;
        return others;
      }());
  // Docked again, everything is as it was.
  for (size_t d = 0; d < robot.dockings.size(); ++d) vms.SetDocked(static_cast<int>(d), true);
  vms.Tick(test::DiameterOf(robot) + 2);
  for (int m = 0; m < 12; ++m) EXPECT_FALSE(vms.state(m).pose.stale);
}

TEST_P(SpatialTest, DetachedAndAttachedElsewhereTheNewPosesAreThereWithinDiameterPlusOneTicks) {
  // Two ways to hang the last module: only one is docked at a time.
  model::Robot robot = test::ChainRobot(model_, 6);
  model::Docking second = robot.dockings.back();
  second.module_a = static_cast<int>(GetParam() % 4);
  second.connector_a = 3;
  for (size_t o = 0; o < model_.connection_types[0].options.size(); ++o) {
    const model::ConnectionOption& option = model_.connection_types[0].options[o];
    if (option.connector_a == 3 && option.connector_b == 0) second.option = static_cast<int>(o);
  }
  robot.dockings.push_back(second);
  VmRobot vms(model_, robot, test::EmptyProgram());
  vms.SetDocked(5, false);
  vms.Tick(10);
  vms.SetDocked(4, false);
  vms.SetDocked(5, true);
  model::Robot after = robot;
  after.dockings.erase(after.dockings.begin() + 4);
  vms.Tick(test::DiameterOf(after) + 1);
  EXPECT_LT(LargestError(vms, model::ForwardKinematics(model_, after, vms.joints())), kTolerance);
}

TEST_P(SpatialTest, AColdStartedModuleFindsItsPlaceAgain) {
  const model::Robot robot = test::RandomRobot(model_, 10, 0, GetParam());
  VmRobot vms(model_, robot, test::EmptyProgram());
  vms.Tick(20);
  vms.ColdStart(5);
  vms.Tick(test::DiameterOf(robot) + 1);
  EXPECT_LT(LargestError(vms, model::ForwardKinematics(model_, robot, vms.joints())), kTolerance);
}

TEST_P(SpatialTest, ASilentRootMakesAllPosesStaleAndItsReturnFresh) {
  const model::Robot robot = test::RandomRobot(model_, 10, 4, GetParam());
  VmRobot vms(model_, robot, test::EmptyProgram());
  vms.Tick(20);
  vms.SetSilent(0, true);
  vms.Tick(static_cast<int>(kPoseStaleTicks) + 12);
  for (int m = 1; m < 10; ++m) EXPECT_TRUE(vms.output(m).status.pose_stale) << m;
  vms.SetSilent(0, false);
  vms.Tick(test::DiameterOf(robot) + 1);
  for (int m = 0; m < 10; ++m) EXPECT_FALSE(vms.output(m).status.pose_stale) << m;
}

TEST_P(SpatialTest, AllPosesFollowTheRootsSensor) {
  const model::Robot robot = test::RandomRobot(model_, 10, 0, GetParam());
  VmRobot vms(model_, robot, test::EmptyProgram());
  const model::KinematicState rest = model::ForwardKinematics(model_, robot, vms.joints());
  const auto at = [&](double north, double turn) {
    // The whole robot, moved in R.
    model::Pose moved = model::Pose::Identity();
    moved.translation() << north, 0.01, -0.3;
    moved.linear() = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY()).toRotationMatrix();
    model::KinematicState truth = rest;
    for (auto& links : truth.X_RL) {
      for (model::Pose& X : links) X = moved * X;
    }
    return truth;
  };
  const auto sense = [&](const model::KinematicState& truth, int link) {
    const auto& links = truth.X_RL[static_cast<size_t>(robot.root_module)];
    vms.SenseRoot(test::ToFloat(links[static_cast<size_t>(link)]), link);
    vms.Tick(test::DiameterOf(robot) + 1);
  };
  for (const double turn : {0.0, 0.7, 2.0}) {
    const model::KinematicState truth = at(0.2 * turn, turn);
    sense(truth, robot.root_link);
    EXPECT_LT(LargestError(vms, truth), kTolerance) << turn;
  }
  // Another link's pose, and what is none, are not believed; without news the last one stays.
  const model::KinematicState last = at(0.4, 2.0);
  sense(at(1, 1), robot.root_link + 1);
  EXPECT_LT(LargestError(vms, last), kTolerance);
  PoseF broken;
  broken.p.x = NAN;
  vms.SenseRoot(broken, robot.root_link);
  vms.Tick(test::DiameterOf(robot) + 1);
  EXPECT_LT(LargestError(vms, last), kTolerance);
  vms.SenseRoot(std::nullopt, 0);
  vms.Tick(20);
  EXPECT_LT(LargestError(vms, last), kTolerance);
}

INSTANTIATE_TEST_SUITE_P(Seeds, SpatialTest, ::testing::Range(uint64_t{1}, uint64_t{9}));

TEST(SpatialQueryTest, UnitsOfDirectionsAreThoseOfNue) {
  EXPECT_EQ(UnitOf(Direction::kNorth).x, 1);
  EXPECT_EQ(UnitOf(Direction::kUp).y, 1);
  EXPECT_EQ(UnitOf(Direction::kEast).z, 1);
  EXPECT_EQ(UnitOf(Direction::kSouth).x, -1);
  EXPECT_EQ(UnitOf(Axis::kEastWest).z, 1);
  EXPECT_EQ(Norm(UnitOf(Axis::kAny)), 0);
}

TEST(SpatialQueryTest, APoseFromTheFarFutureIsNotBelieved) {
  const model::Model model = test::ToyModel();
  const model::Robot robot = test::ChainRobot(model, 2);
  VmRobot vms(model, robot, test::EmptyProgram());
  vms.Tick(5);
  TickInput input;
  input.tick = vms.tick() + 1;
  input.sim_time_us = input.tick * 20000;
  for (int c = 0; c < 6; ++c) {
    input.connectors[c] = vms.state(1).neighbours[c].sensor;
    if (!input.connectors[c].docked) continue;
    NeighbourMessage lie = vms.output(0).message;
    lie.root_sequence = input.tick + 1000000;
    input.messages[c] = &lie;
    TickOutput output;
    vms.vm(1).Tick(input, &output);
    EXPECT_LE(vms.state(1).pose.sequence, input.tick);
    // Nor one that is not a number.
    lie = vms.output(0).message;
    lie.tick = lie.root_sequence = input.tick;
    for (PoseF& X : lie.X_RL) X.p.x = NAN;
    ++input.tick;
    vms.vm(1).Tick(input, &output);
    EXPECT_TRUE(std::isfinite(vms.state(1).pose.X_RL[0].p.x));
  }
}

}  // namespace
}  // namespace morphbus::vm
