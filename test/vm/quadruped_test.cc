// The paper's quadruped (Sec. V) and its equivalent, whole robots of VMs against known answers.

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "compiler/model/forward_kinematics.h"
#include "test/support/compiled.h"
#include "test/support/toy_model.h"
#include "test/support/vm_robot.h"
#include "vm/image/fault_text.h"

namespace morphbus::vm {
namespace {

using test::VmRobot;
using test::VmRobotOptions;

const model::Model& Mtran() {
  static const model::Model model = test::ModelFrom("models/mtran.m3l");
  return model;
}

const std::vector<uint8_t>& Program() {
  static const std::vector<uint8_t> image =
      test::ProgramFrom(test::TextOf("models/programs/quadruped.dyn"), Mtran());
  return image;
}

using Roles = std::map<std::string, std::string>;

const Roles kQuadruped = {
    {"m1", "FrontLeftLowerHalf"},  {"m2", "FrontLeftUpperHalf"}, {"m3", "BackLeftUpperHalf"},
    {"m4", "BackLeftLowerHalf"},   {"m5", "Junction"},           {"m6", "FrontRightLowerHalf"},
    {"m7", "FrontRightUpperHalf"}, {"m8", "BackRightUpperHalf"}, {"m9", "BackRightLowerHalf"}};
const Roles kEquivalent = {
    {"m6", "FrontLeftLowerHalf"},  {"m7", "FrontLeftUpperHalf"}, {"m8", "BackLeftUpperHalf"},
    {"m9", "BackLeftLowerHalf"},   {"m5", "Junction"},           {"m1", "FrontRightLowerHalf"},
    {"m2", "FrontRightUpperHalf"}, {"m3", "BackRightUpperHalf"}, {"m4", "BackRightLowerHalf"}};

Roles RolesOf(const VmRobot& robot) {
  Roles roles;
  for (int m = 0; m < robot.size(); ++m) {
    roles[robot.robot().modules[static_cast<size_t>(m)].name] = robot.RoleOf(m);
  }
  return roles;
}

struct Case {
  const char* robot;
  const Roles* roles;
};

class QuadrupedTest : public ::testing::TestWithParam<Case> {
 protected:
  static const model::Robot& Robot() { return *Mtran().FindRobot(GetParam().robot); }
};

TEST_P(QuadrupedTest, EveryModuleTakesItsRole) {
  VmRobot vms(Mtran(), Robot(), Program());
  vms.Tick(40);
  EXPECT_EQ(RolesOf(vms), *GetParam().roles);
  for (const auto& event : vms.faults()) {
    ADD_FAILURE() << "module " << event.module << ": " << FaultName(event.fault.code);
  }
}

TEST_P(QuadrupedTest, LabelsAreTheJointsOfThePaper) {
  VmRobot vms(Mtran(), Robot(), Program());
  vms.Tick(40);
  const model::ModuleType& type = Mtran().module_types[0];
  for (int m = 0; m < vms.size(); ++m) {
    const std::string role = vms.RoleOf(m);
    if (role == "Junction") continue;
    const int bar = *type.FindLink("connecting_bar");
    EXPECT_EQ(vms.LabelOf(m, "bar"), bar) << role;
    if (role.find("Upper") != std::string::npos) {
      EXPECT_NE(vms.LabelOf(m, "upper_joint"), vms.LabelOf(m, "hip")) << role;
      continue;
    }
    // The foot is the block without a mate, the ankle its joint.
    const int foot = vms.LabelOf(m, "foot");
    for (int c = 0; c < 6; ++c) {
      if (vms.state(m).neighbours[c].sensor.docked) {
        EXPECT_NE(type.connectors[static_cast<size_t>(c)].link, foot);
      }
    }
    const int ankle = vms.LabelOf(m, "ankle");
    EXPECT_EQ(type.joints[static_cast<size_t>(ankle)].link_a, foot) << role;
    EXPECT_EQ(vms.LabelOf(m, "knee"), 1 - ankle) << role;
  }
}

constexpr char kAsksWhere[] = R"(
role R extends Module {
  north = 0.0; up = 0.0; east = 0.0; heading = 0.0; id = 0; mine = false;
  behavior b() {
    north = self.place($NORTH_SOUTH);
    up = self.place($UP_DOWN);
    east = self.place($EAST_WEST);
    heading = self.heading;
    id = self.id;
    mine = self.role == $R;
    print(north, up, east, heading, id, mine);
  }
}
)";

// The modules' origins in the robot frame are the known answers of spec/m3l.md, in model units of
// 32.5 mm; a module's links have one frame at the beginning, so that its place is its origin.
TEST_P(QuadrupedTest, ModulesKnowWhoAndWhereTheyAre) {
  VmRobot vms(Mtran(), Robot(), test::ProgramFrom(kAsksWhere, Mtran()));
  vms.Tick(40);
  const model::KinematicState truth = model::ForwardKinematics(Mtran(), Robot(), vms.joints());
  for (int m = 0; m < vms.size(); ++m) {
    const Cell* fields = vms.state(m).role.fields;
    const PoseF X_RL = test::ToFloat(truth.X_RL[static_cast<size_t>(m)][0]);
    EXPECT_NEAR(fields[0].AsFloat(), X_RL.p.x * 1000, 0.01);
    EXPECT_NEAR(fields[1].AsFloat(), 0, 0.01);
    EXPECT_NEAR(fields[2].AsFloat(), X_RL.p.z * 1000, 0.01);
    // All stand as the root does or are turned about north.
    EXPECT_NEAR(fields[3].AsFloat(), 0, 0.01);
    EXPECT_EQ(fields[4].AsInt(), m + 1);
    EXPECT_TRUE(fields[5].AsBool());
  }
  const double m1_east = GetParam().robot == std::string("quadruped") ? -65 : 65;
  EXPECT_NEAR(vms.state(0).role.fields[0].AsFloat(), 162.5, 0.01);
  EXPECT_NEAR(vms.state(0).role.fields[2].AsFloat(), m1_east, 0.01);
}

/// The targets that each joint was given in turn, without the times.
using Walk = std::vector<std::vector<double>>;

Walk Record(VmRobot* vms, int ticks) {
  Walk walk(18, std::vector<double>(1, 0.0));
  for (int i = 0; i < ticks; ++i) {
    vms->Tick();
    for (size_t j = 0; j < 18; ++j) {
      const double target = vms->output(static_cast<int>(j / 2)).joints[j % 2].target;
      if (target != walk[j].back()) walk[j].push_back(target);
    }
  }
  return walk;
}

TEST_P(QuadrupedTest, AnyOfTheNineModulesCanBeTheRootOfTheSameWalk) {
  VmRobot reference(Mtran(), Robot(), Program());
  const Walk expected = Record(&reference, 1000);
  for (int root = 0; root < 9; ++root) {
    VmRobotOptions options;
    options.root = root;
    VmRobot vms(Mtran(), Robot(), Program(), options);
    const Walk walk = Record(&vms, 1000);
    EXPECT_EQ(RolesOf(vms), *GetParam().roles) << "root m" << root + 1;
    EXPECT_TRUE(vms.faults().empty());
    for (size_t j = 0; j < walk.size(); ++j) {
      // The run may end within a step.
      const size_t n = std::min(walk[j].size(), expected[j].size());
      EXPECT_LE(std::max(walk[j].size(), expected[j].size()) - n, 1u);
      for (size_t i = 0; i < n; ++i) {
        ASSERT_NEAR(walk[j][i], expected[j][i], 1e-12) << "root m" << root + 1 << " joint " << j;
      }
    }
  }
}

TEST_P(QuadrupedTest, RolesAreKeptThroughTenGaitCyclesWithoutFaults) {
  VmRobot vms(Mtran(), Robot(), Program());
  vms.Tick(60);
  int moved = 0;
  for (int i = 0; i < 5000; ++i) {
    vms.Tick();
    ASSERT_EQ(RolesOf(vms), *GetParam().roles) << "tick " << vms.tick();
    moved += std::abs(vms.joints()[0][0]) > 0.1 ? 1 : 0;
  }
  EXPECT_GT(moved, 500);
  for (const auto& event : vms.faults()) {
    ADD_FAILURE() << "module " << event.module + 1 << " line " << event.fault.line << ": "
                  << FaultName(event.fault.code) << " " << event.fault.asked;
  }
}

TEST_P(QuadrupedTest, AModuleThatBeginsAnewIsBackInItsRoleInASecondAndNobodyElseLosesOne) {
  // Standing, and at moments of the walk; the root among the nine.
  for (const int moment : {60, 333, 701}) {
    for (int module = 0; module < 9; ++module) {
      VmRobot vms(Mtran(), Robot(), Program());
      vms.Tick(moment);
      vms.ColdStart(module);
      for (int tick = 0; tick < 50; ++tick) {
        vms.Tick();
        Roles roles = RolesOf(vms);
        const std::string& own = vms.robot().modules[static_cast<size_t>(module)].name;
        if (tick == 0) {
          EXPECT_EQ(roles[own], "") << "no role until settled";
        }
        if (tick < 49) roles[own] = GetParam().roles->at(own);
        ASSERT_EQ(roles, *GetParam().roles) << own << " at " << moment << ", tick " << tick;
      }
    }
  }
}

TEST_P(QuadrupedTest, DistributedKinematicsAreTheModelsWhileTheLegsStandStill) {
  VmRobot vms(Mtran(), Robot(), Program());
  vms.Tick(100);  // Standing, before the gait moves anything.
  const model::JointValues before = vms.joints();
  vms.Tick(test::DiameterOf(Robot()) + 1);
  ASSERT_EQ(before, vms.joints());
  const model::KinematicState truth = model::ForwardKinematics(Mtran(), Robot(), vms.joints());
  for (int m = 0; m < 9; ++m) {
    for (size_t i = 0; i < 3; ++i) {
      const PoseF expected = test::ToFloat(truth.X_RL[static_cast<size_t>(m)][i]);
      const PoseF& actual = vms.state(m).pose.X_RL[i];
      EXPECT_LT(Norm(Subtract(actual.p, expected.p)), 1e-5f) << "module " << m + 1;
    }
  }
}

TEST_P(QuadrupedTest, LossAndLateMessagesChangeNeitherRolesNorTargets) {
  VmRobotOptions options;
  options.loss = 0.3;
  options.late = 0.2;
  options.grace_ticks = 25;
  VmRobot vms(Mtran(), Robot(), Program(), options);
  VmRobot reference(Mtran(), Robot(), Program());
  const Walk walk = Record(&vms, 3000);
  const Walk expected = Record(&reference, 3000);
  EXPECT_EQ(RolesOf(vms), *GetParam().roles);
  for (const auto& event : vms.faults()) {
    ADD_FAILURE() << "module " << event.module + 1 << ": " << FaultName(event.fault.code);
  }
  // Each command ran exactly once, on the right module, in order; only the times differ.
  for (size_t j = 0; j < walk.size(); ++j) {
    const size_t n = std::min(walk[j].size(), expected[j].size());
    EXPECT_LE(std::max(walk[j].size(), expected[j].size()) - n, 3u);
    for (size_t i = 0; i < n; ++i) {
      ASSERT_NEAR(walk[j][i], expected[j][i], 1e-12) << "joint " << j << " step " << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, QuadrupedTest,
                         ::testing::Values(Case{"quadruped", &kQuadruped},
                                           Case{"equivalent_quadruped", &kEquivalent}),
                         [](const auto& test) { return std::string(test.param.robot); });

/// Sign of each labelled joint, by role and label.
std::map<std::string, int> SignsOf(const VmRobot& robot) {
  std::map<std::string, int> signs;
  for (int m = 0; m < robot.size(); ++m) {
    for (const char* label : {"ankle", "knee", "hip", "upper_joint"}) {
      const int joint = robot.LabelOf(m, label);
      if (joint >= 0) signs[robot.RoleOf(m) + "." + label] = robot.output(m).status.signs[joint];
    }
  }
  return signs;
}

TEST(QuadrupedPairTest, SignsDifferOnlyAtTheLowerHalvesNumbered19) {
  VmRobot first(Mtran(), *Mtran().FindRobot("quadruped"), Program());
  VmRobot second(Mtran(), *Mtran().FindRobot("equivalent_quadruped"), Program());
  first.Tick(60);
  second.Tick(60);
  const std::map<std::string, int> a = SignsOf(first), b = SignsOf(second);
  ASSERT_EQ(a.size(), 16u);
  for (const auto& [name, sign] : a) {
    EXPECT_NE(sign, 0) << name;
    const bool differs =
        (name.rfind("FrontLeftLower", 0) == 0 || name.rfind("BackRightLower", 0) == 0);
    EXPECT_EQ(b.at(name), differs ? -sign : sign) << name;
  }
}

TEST(QuadrupedPairTest, AfterDisconnectOnlyTheLabelsKeepTheJunctionFromBeingAnUpperHalf) {
  VmRobot vms(Mtran(), *Mtran().FindRobot("quadruped"), Program());
  vms.Tick(60);
  const int m2 = vms.ModuleNamed("m2"), m5 = vms.ModuleNamed("m5");
  vms.SetDocked(vms.DockingAt(m2, "c3"), false);
  vms.Tick(40);
  const RoleCheck check = vms.vm(m5).CheckRole(vms.RoleNamed("FrontRightUpperHalf"));
  EXPECT_TRUE(check.requirements_hold);
  EXPECT_FALSE(check.labels_resolve);
  EXPECT_FALSE(check.fits());
  EXPECT_EQ(vms.RoleOf(m5), "");
  EXPECT_EQ(vms.output(m5).status.num_tasks, 0);
  // Joined again, it leads again.
  vms.SetDocked(vms.DockingAt(m2, "c3"), true);
  vms.Tick(40);
  EXPECT_EQ(vms.RoleOf(m5), "Junction");
}

}  // namespace
}  // namespace morphbus::vm
