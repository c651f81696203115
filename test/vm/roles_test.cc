#include "vm/role/roles.h"

#include <gtest/gtest.h>

#include <string>

#include "compiler/m3l/compile.h"
#include "test/support/compiled.h"
#include "test/support/toy_model.h"
#include "test/support/vm_robot.h"
#include "vm/image/disassembler.h"

namespace morphbus::vm {
namespace {

using test::VmRobot;
using test::VmRobotOptions;

/// M-TRAN modules in a row from north (m1, the root) to south.
model::Model RowModel(int modules) {
  std::string text = test::TextOf("models/mtran.m3l") + "\nrobot row: modules=(MTRAN m1";
  for (int i = 2; i <= modules; ++i) text += ", MTRAN m" + std::to_string(i);
  text += "), connections=(";
  for (int i = 1; i < modules; ++i) {
    text += (i > 1 ? ", (m" : "(m") + std::to_string(i) + ".c2,m" + std::to_string(i + 1) + ".c5)";
  }
  const m3l::CompileOutput output = m3l::CompileText("row.m3l", text + ")\n");
  EXPECT_TRUE(output.model.has_value());
  return *output.model;
}

class RolesTest : public ::testing::Test {
 protected:
  /// `modules` M-TRANs in a row.
  VmRobot& Row(int modules, const std::string& program, VmRobotOptions options = {}) {
    model_ = RowModel(modules);
    vms_ = std::make_unique<VmRobot>(model_, *model_.FindRobot("row"),
                                     test::ProgramFrom(program, model_), options);
    return *vms_;
  }
  model::Model model_;
  std::unique_ptr<VmRobot> vms_;
};

constexpr char kSnake[] = R"(
role Head extends Module {
  require self.connected($NORTH) == 0;
  require self.connected($SOUTH) == 1;
}
role Segment extends Module {
  require self.connected($NORTH, $Head) == 1 || self.connected($NORTH, $Segment) == 1;
}
role Tail extends Segment {
  require self.connected($SOUTH) == 0;
}
)";

TEST_F(RolesTest, RolesSpreadFromHeadToTail) {
  VmRobot& vms = Row(6, kSnake);
  vms.Tick(150);
  EXPECT_EQ(vms.RoleOf(0), "Head");
  for (int m = 1; m < 5; ++m) EXPECT_EQ(vms.RoleOf(m), "Segment");
  EXPECT_EQ(vms.RoleOf(5), "Tail");
  EXPECT_TRUE(vms.faults().empty());
}

TEST_F(RolesTest, NoModuleTakesABaseRoleWhileASubroleMayStillFit) {
  VmRobot& vms = Row(6, kSnake);
  for (int i = 0; i < 150; ++i) {
    vms.Tick();
    EXPECT_NE(vms.RoleOf(5), "Segment");
  }
}

TEST_F(RolesTest, ARoleIsTakenOnceItsGroundsAreUnchangedForTenTicks) {
  VmRobot& vms = Row(2, "role Any extends Module { }");
  // Tick 0: docked, nothing heard. 1: the root heard of; its mate has a pose. 2: the root hears a
  // mate that has a pose, too.
  for (int i = 0; i <= 11; ++i) {
    vms.Tick();
    EXPECT_EQ(vms.RoleOf(0), "") << "tick " << i;
  }
  vms.Tick();
  EXPECT_EQ(vms.RoleOf(0), "Any");
}

TEST_F(RolesTest, ANeighbourThatBeginsAnewAndTakesNoRoleIsEvidenceAfterASecond) {
  VmRobot& vms = Row(3, R"(
role Head extends Module { require self.connected($NORTH) == 0; }
role Next extends Module { require self.connected($NORTH, $Head) == 1; }
)");
  vms.Tick(60);
  ASSERT_EQ(vms.RoleOf(1), "Next");
  // A program without roles is what the head runs from now on.
  vms.ColdStart(0);
  vms.ReplaceProgram(0, test::EmptyProgram());
  for (int i = 0; i < kSilentTicks; ++i) {
    vms.Tick();
    ASSERT_EQ(vms.RoleOf(1), "Next") << i;
  }
  vms.Tick(20);
  EXPECT_EQ(vms.RoleOf(1), "");
}

TEST_F(RolesTest, TheSettlingTimeBeginsAnewWithEachChange) {
  VmRobot& vms = Row(2, "role Pair extends Module { require sizeof(self.connected) == 1; }");
  vms.Tick(30);
  ASSERT_EQ(vms.RoleOf(0), "Pair");
  // Seven undockings that last eight ticks each: never settled, so no evidence.
  for (int i = 0; i < 7; ++i) {
    vms.SetDocked(0, false);
    vms.Tick(8);
    EXPECT_EQ(vms.RoleOf(0), "Pair");
    vms.SetDocked(0, true);
    vms.Tick(8);
    EXPECT_EQ(vms.RoleOf(0), "Pair");
  }
  vms.SetDocked(0, false);
  vms.Tick(11);
  EXPECT_EQ(vms.RoleOf(0), "");
}

TEST_F(RolesTest, OfARoleAndItsSubroleTheMostDerivedWins) {
  VmRobot& vms = Row(1, R"(
role C extends B { }
role A extends Module { }
role B extends A { }
)");
  vms.Tick(30);
  EXPECT_EQ(vms.RoleOf(0), "C");
  EXPECT_TRUE(vms.faults().empty());
}

TEST_F(RolesTest, AbstractRolesAreNeverTaken) {
  VmRobot& vms = Row(1, "abstract role A extends Module { }");
  vms.Tick(30);
  EXPECT_EQ(vms.RoleOf(0), "");
}

TEST_F(RolesTest, OfTwoUnrelatedRolesTheFirstDeclaredIsTakenAndTheAmbiguityIsToldOnce) {
  VmRobot& vms = Row(1, R"(
role B extends Module {
  require true;
}
role A extends Module { }
)");
  vms.Tick(100);
  EXPECT_EQ(vms.RoleOf(0), "B");
  EXPECT_EQ(vms.CountFaults(FaultCode::kAmbiguousRole), 1);
  ASSERT_EQ(vms.faults().size(), 1u);
  EXPECT_EQ(vms.faults()[0].fault.role, vms.RoleNamed("B"));
  EXPECT_EQ(vms.faults()[0].fault.rival_role, vms.RoleNamed("A"));
  EXPECT_EQ(vms.faults()[0].fault.line, 3) << "in the role that is taken";
}

TEST_F(RolesTest, ALabelThatFitsNothingOrSeveralThingsKeepsTheRoleAway) {
  for (const char* label : {"self.joints($ANY, 7)", "self.joints($ANY, 1)"}) {
    // A module alone: both of its joints touch the bar, so each has one adjacent joint.
    VmRobot& vms = Row(1, std::string("role A extends Module { label j = ") + label + "; }");
    vms.Tick(30);
    EXPECT_EQ(vms.RoleOf(0), "");
    EXPECT_TRUE(vms.faults().empty());
    const RoleCheck check = vms.vm(0).CheckRole(0);
    EXPECT_TRUE(check.requirements_hold);
    EXPECT_FALSE(check.labels_resolve);
    EXPECT_EQ(check.failed_label, 0);
  }
}

TEST_F(RolesTest, ARequirementThatFailsTellsWhatItMeasured) {
  const auto measured = [this](const std::string& requirement) {
    VmRobot& vms =
        Row(3, "role A extends Module {\n  wanted = 7;\n  require " + requirement + ";\n}");
    vms.Tick(30);
    const RoleCheck check = vms.vm(1).CheckRole(0);
    EXPECT_EQ(check.failed_requirement, 0);
    if (check.measured.opcode == Opcode::kPop) return std::string("nothing");
    return ComparisonText(check.measured, vms.program());
  };
  EXPECT_EQ(measured("sizeof(self.connected) == 9"), "2 against 9");
  EXPECT_EQ(measured("sizeof(self.connected) != 2"), "2 against 2");
  EXPECT_EQ(measured("sizeof(self.connected) >= 2 && sizeof(self.connected) > 3"), "2 against 3");
  EXPECT_EQ(measured("sizeof(self.connected) == wanted"), "2 against 7");
  EXPECT_EQ(measured("self.center == $UP_DOWN"), "$ANY against $UP_DOWN");
  EXPECT_EQ(measured("false"), "nothing");
}

TEST_F(RolesTest, JointsMovingAloneNeverTakeARoleAway) {
  VmRobot& vms = Row(3, R"(
role Middle extends Module {
  require self.connected($NORTH) == 1;
  require self.connected($SOUTH) == 1;
}
role End extends Module { require sizeof(self.connected) == 1; }
)");
  vms.Tick(40);
  ASSERT_EQ(vms.RoleOf(1), "Middle");
  // m1's blocks turn by 90 degrees each: m2 then looks up and down.
  for (int i = 0; i < 100; ++i) {
    vms.joints()[0] = {-1.5, 1.5};
    vms.joints()[1] = {0.3, -1.4};
    vms.Tick();
    ASSERT_EQ(vms.RoleOf(1), "Middle");
  }
  EXPECT_FALSE(vms.vm(1).CheckRole(vms.RoleNamed("Middle")).requirements_hold);
}

TEST_F(RolesTest, ARoleLostEndsItsTasksWhileJointsHoldTheirTargets) {
  VmRobot& vms = Row(2, R"(
role Pair extends Module {
  startup s() { self.setJointAxis(self.JOINT_1, $LINK_ACTIVE_BLOCK, $EAST_WEST); }
  behavior b() {
    self.jointRotateDegrees(self.JOINT_1, 40);
    self.jointRotateDegrees(self.JOINT_1, -40);
  }
  require sizeof(self.connected) == 1;
}
)");
  vms.Tick(60);
  ASSERT_EQ(vms.RoleOf(1), "Pair");
  EXPECT_NE(vms.output(1).status.signs[0], 0);
  EXPECT_EQ(vms.output(1).status.num_tasks, 1);
  vms.SetDocked(0, false);
  vms.Tick(25);  // Ten to settle, and ten more when its pose has become stale.
  ASSERT_EQ(vms.RoleOf(1), "");
  EXPECT_EQ(vms.output(1).status.num_tasks, 0);
  EXPECT_EQ(vms.output(1).status.signs[0], 0);
  EXPECT_TRUE(vms.output(1).joints[0].mode == ActuatorMode::kPosition);
  const double target = vms.output(1).joints[0].target;
  for (int i = 0; i < 50; ++i) {
    vms.Tick();
    EXPECT_EQ(vms.output(1).joints[0].target, target);
  }
}

TEST_F(RolesTest, ARoleThatChangesTooOftenIsFrozenAndToldOnce) {
  VmRobot& vms = Row(2, R"(
role Pair extends Module { require sizeof(self.connected) == 1; }
role Lone extends Module { require sizeof(self.connected) == 0; }
)");
  vms.Tick(25);
  for (int i = 0; i < 12; ++i) {
    vms.SetDocked(0, i % 2 != 0);
    vms.Tick(15);
  }
  EXPECT_TRUE(vms.output(0).status.frozen);
  const std::string role = vms.RoleOf(0);
  vms.SetDocked(0, role == "Lone");
  vms.Tick(600);
  EXPECT_EQ(vms.RoleOf(0), role);
  int told = 0;
  for (const auto& event : vms.faults()) {
    told += event.module == 0 && event.fault.code == FaultCode::kRoleFlicker ? 1 : 0;
  }
  EXPECT_EQ(told, 1);
}

TEST_F(RolesTest, EightChangesInFiveSecondsAreAllowed) {
  VmRobot& vms = Row(2, R"(
role Pair extends Module { require sizeof(self.connected) == 1; }
role Lone extends Module { require sizeof(self.connected) == 0; }
)");
  vms.Tick(25);
  for (int i = 0; i < 20; ++i) {  // One change in 0.8 s.
    vms.SetDocked(0, i % 2 != 0);
    vms.Tick(40);
    EXPECT_EQ(vms.RoleOf(0), i % 2 != 0 ? "Pair" : "Lone");
  }
  EXPECT_FALSE(vms.output(0).status.frozen);
}

TEST_F(RolesTest, WithoutAFreshPoseNoRoleIsTakenAndTheOneHeldStays) {
  VmRobot& vms = Row(3, "role Any extends Module { require sizeof(self.connected) > 0; }");
  vms.SetDocked(0, false);
  vms.Tick(40);
  EXPECT_EQ(vms.RoleOf(1), "");
  vms.SetDocked(0, true);
  vms.Tick(40);
  EXPECT_EQ(vms.RoleOf(1), "Any");
  vms.SetSilent(0, true);
  vms.Tick(100);
  EXPECT_TRUE(vms.output(1).status.pose_stale);
  EXPECT_EQ(vms.RoleOf(1), "Any");
}

TEST_F(RolesTest, AnotherProgramReplacesRoleAndTasks) {
  VmRobot& vms = Row(2, R"(
role Old extends Module {
  behavior b() { self.jointSetDegrees(self.JOINT_1, 30); self.sleepds(1); }
}
)");
  vms.Tick(60);
  ASSERT_EQ(vms.RoleOf(0), "Old");
  const double target = vms.output(0).joints[0].target;
  const std::vector<uint8_t> program = test::ProgramFrom(
      "role First extends Module { require self.connected($ANY, $First) == 1; }"
      "role New extends Module { startup s() { self.jointSetDegrees(self.JOINT_2, 20); } }",
      model_);
  vms.ReplaceProgram(0, program);
  vms.Tick();
  EXPECT_EQ(vms.output(0).joints[0].target, target);
  // The mate still runs the old program: its role 0 is not this program's role 0.
  EXPECT_EQ(vms.output(0).status.role, 1);
  vms.Tick(30);
  EXPECT_EQ(vms.output(0).status.role, 1);
  EXPECT_NEAR(vms.output(0).joints[1].target, 20 * M_PI / 180, 1e-12);
}

TEST(MixedRobotTest, ARoleWithAKeywordThatTheTypeLacksCannotBeTaken) {
  const model::Model model = test::ToyModel();
  model::Robot robot = test::RandomRobot(model, 10, 0, 2);
  const std::vector<uint8_t> program = test::ProgramFrom(R"(
role Slides extends Module { label s = $LINK_SLIDER; }
role Turns extends Module { label t = $LINK_TWO; }
)",
                                                         model);
  VmRobot vms(model, robot, program);
  vms.Tick(60);
  int slides = 0;
  for (int m = 0; m < vms.size(); ++m) {
    const bool rail = robot.modules[static_cast<size_t>(m)].type == 1;
    slides += rail ? 1 : 0;
    EXPECT_EQ(vms.RoleOf(m), rail ? "Slides" : "Turns");
    EXPECT_EQ(vms.output(m).status.labels[0], rail ? 2 : 1);
    EXPECT_GE(vms.vm(m).CheckRole(vms.RoleNamed(rail ? "Turns" : "Slides")).missing_keyword, 0);
  }
  EXPECT_GT(slides, 0);
  EXPECT_TRUE(vms.faults().empty());
}

}  // namespace
}  // namespace morphbus::vm
