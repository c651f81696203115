// Tasks and motion: what a program's statements do to joints, tick by tick.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "test/support/compiled.h"
#include "test/support/toy_model.h"
#include "test/support/vm_robot.h"

namespace morphbus::vm {
namespace {

using test::VmRobot;
using test::VmRobotOptions;

constexpr double kDegree = M_PI / 180;

class TasksTest : public ::testing::Test {
 protected:
  /// One module of toy type `type` (0 Hinge, 1 Rail), start values 0, with roles' bodies as given.
  VmRobot& Lone(const std::string& members, int type = 0, VmRobotOptions options = {}) {
    robot_ = test::ChainRobot(model_, 1);
    robot_.modules[0].type = type;
    robot_.modules[0].start.assign(model_.module_types[static_cast<size_t>(type)].joints.size(),
                                   0.0);
    vms_ = std::make_unique<VmRobot>(
        model_, robot_, test::ProgramFrom("role R extends Module {\n" + members + "\n}\n", model_),
        options);
    return *vms_;
  }
  /// Ticks until the role is held; the startup has run its first stretch then.
  void TakeRole() {
    for (int i = 0; i < 30 && vms_->output(0).status.role < 0; ++i) vms_->Tick();
    ASSERT_EQ(vms_->output(0).status.role, 0);
  }
  [[nodiscard]] double Target(int joint = 0) const {
    return vms_->output(0).joints[joint].target / kDegree;
  }
  /// Distinct targets of joint 0 in the order they were set, over `ticks` ticks.
  std::vector<int> Targets(int ticks) {
    std::vector<int> targets;
    for (int i = 0; i < ticks; ++i) {
      vms_->Tick();
      const int target = static_cast<int>(std::lround(Target()));
      if (targets.empty() || targets.back() != target) targets.push_back(target);
    }
    return targets;
  }
  const model::Model model_ = test::ToyModel();
  model::Robot robot_;
  std::unique_ptr<VmRobot> vms_;
};

TEST_F(TasksTest, StartupsRunInOrderBeforeTheBehaviorThatRepeats) {
  Lone(R"(
  startup one() { self.jointRotateDegrees(self.TURN, 10); }
  behavior b() { self.jointRotateDegrees(self.TURN, 5); self.jointRotateDegrees(self.TURN, -4); }
  startup two() { self.jointRotateDegrees(self.TURN, 20); }
)");
  std::vector<int> targets = Targets(60);
  ASSERT_GE(targets.size(), 10u);
  targets.resize(10);
  EXPECT_EQ(targets, (std::vector<int>{0, 10, 30, 35, 31, 36, 32, 37, 33, 38}));
}

TEST_F(TasksTest, ABlockingTurnReturnsWhenTheSetPointHasArrived) {
  Lone(R"(
  startup s() { self.jointRotateDegrees(self.TURN, 45); self.jointRotateDegrees(self.TURN, -1); }
)");
  TakeRole();
  EXPECT_NEAR(Target(), 45, 1e-9);
  // 45 degrees at 3.6 degrees a tick: there on the thirteenth.
  for (int i = 0; i < 12; ++i) {
    vms_->Tick();
    EXPECT_NEAR(Target(), 45, 1e-9) << i;
  }
  vms_->Tick();
  EXPECT_NEAR(Target(), 44, 1e-9);
}

TEST_F(TasksTest, NonBlockingThenBlockingOnAnotherJointStartInTheSameTick) {
  VmRobot& vms = Lone(R"(
  startup s() {
    self.turnContinuous(self.SPIN, 20);
    self.jointMoveMillimetres(self.SLIDE, 30);
    self.turnContinuous(self.SPIN, -10);
  }
)",
                      1);
  TakeRole();
  EXPECT_TRUE(vms.output(0).joints[2].mode == ActuatorMode::kVelocity);
  EXPECT_NEAR(vms.output(0).joints[2].speed, 20 * kDegree, 1e-9);
  EXPECT_NEAR(vms.output(0).joints[1].target, 0.030, 1e-9);
  vms.Tick(14);  // 30 mm at 2 mm a tick.
  EXPECT_NEAR(vms.output(0).joints[2].speed, 20 * kDegree, 1e-9);
  vms.Tick();
  EXPECT_NEAR(vms.output(0).joints[2].speed, -10 * kDegree, 1e-9);
  EXPECT_TRUE(vms.faults().empty());
}

TEST_F(TasksTest, FortyFiveAndFortyFiveIsNinetyAndNotClamped) {
  VmRobot& vms = Lone(R"(
  startup s() {
    self.jointRotateDegrees(self.TURN, 45); self.jointRotateDegrees(self.TURN, 45);
    self.jointRotateDegrees(self.TURN, -45); self.jointRotateDegrees(self.TURN, -45);
  }
)");
  EXPECT_EQ(Targets(120), (std::vector<int>{0, 45, 90, 45, 0}));
  EXPECT_TRUE(vms.faults().empty());
  EXPECT_EQ(vms.state(0).joints[0].target, 0.0);  // Exactly.
}

TEST_F(TasksTest, BeyondALimitTheTargetIsClampedAndTheFaultNamesTheLine) {
  VmRobot& vms = Lone(R"(  startup s() {
    self.jointRotateDegrees(self.TURN, 80);
    self.jointRotateDegrees(self.TURN, 10.02);
    self.sleepds(1);
    self.jointSetDegrees(self.TURN, -90.005);
  })");
  vms.Tick(200);
  ASSERT_EQ(vms.faults().size(), 1u);
  const Fault& fault = vms.faults()[0].fault;
  EXPECT_TRUE(fault.code == FaultCode::kTargetClamped);
  EXPECT_EQ(fault.line, 4);
  EXPECT_EQ(fault.joint, 0);
  EXPECT_NEAR(fault.asked, 90.02, 1e-4);
  EXPECT_NEAR(fault.limit, 90, 1e-4);
  // Within the tolerance nothing is said, but the actuator never hears of more than its limit.
  EXPECT_GE(vms.output(0).joints[0].target, -M_PI / 2 - 1e-7);
}

TEST_F(TasksTest, ABlockedJointStallsTheCallReturnsAndTheHandlerRuns) {
  VmRobot& vms = Lone(R"(
  seen = 0;
  startup s() { self.jointRotateDegrees(self.TURN, 36); self.jointRotateDegrees(self.TURN, 1); }
  handler on_stall() { seen += 1; }
)");
  vms.Block(0, 0, true);
  TakeRole();
  const int64_t begin = vms.tick();
  while (vms.CountFaults(FaultCode::kStalled) == 0 && vms.tick() < begin + 100) vms.Tick();
  // Ten ticks for the set-point, then half a second.
  EXPECT_EQ(vms.tick() - begin, 10 + 25);
  EXPECT_NEAR(Target(), 37, 1e-9);
  EXPECT_NEAR(vms.faults()[0].fault.asked, 36, 1e-6);
  vms.Tick(200);  // The next call stalls, too; then nothing more is said.
  EXPECT_EQ(vms.CountFaults(FaultCode::kStalled), 2);
  EXPECT_GE(vms.state(0).role.fields[0].AsInt(), 1);
}

TEST_F(TasksTest, AStallNamesTheJointItsAngleAndTheCallThatWaits) {
  VmRobot& vms = Lone(R"(
  startup s() {
    self.jointRotateDegreesNonBlocking(self.TURN, 18);
    self.jointRotateDegrees(self.TURN, 18);
  }
)");
  vms.joints()[0][0] = 5 * kDegree;
  vms.Block(0, 0, true);
  vms.Tick(100);
  ASSERT_EQ(vms.faults().size(), 1u);
  const Fault& fault = vms.faults()[0].fault;
  EXPECT_TRUE(fault.code == FaultCode::kStalled);
  EXPECT_EQ(fault.joint, 0);
  EXPECT_EQ(fault.line, 5);
  EXPECT_EQ(fault.function, 0);
  EXPECT_NEAR(fault.asked, 41, 1e-4);
  EXPECT_NEAR(fault.measured, 5, 1e-4);
  EXPECT_NEAR(fault.limit, 2, 1e-6);
}

TEST_F(TasksTest, AStallThatNoCallWaitsForNamesTheCallThatAskedForIt) {
  VmRobot& vms = Lone(R"(
  startup s() {
    self.jointRotateDegreesNonBlocking(self.TURN, 18);
    self.sleepds(30);
  }
)");
  vms.Block(0, 0, true);
  vms.Tick(100);
  ASSERT_EQ(vms.faults().size(), 1u);
  EXPECT_EQ(vms.faults()[0].fault.line, 4);
}

TEST_F(TasksTest, AWheelThatCannotTurnStallsAndTheHandlerRuns) {
  VmRobot& vms = Lone(R"(
  seen = 0;
  startup s() {
    self.turnContinuous(self.SPIN, -90);
  }
  handler on_stall() { seen += 1; }
)",
                      1);
  vms.Block(0, 2, true);
  TakeRole();
  const int64_t begin = vms.tick();
  while (vms.faults().empty() && vms.tick() < begin + 100) vms.Tick();
  EXPECT_EQ(vms.tick() - begin, 25) << "half a second";
  vms.Tick(200);
  ASSERT_EQ(vms.faults().size(), 1u) << "told once";
  const Fault& fault = vms.faults()[0].fault;
  EXPECT_TRUE(fault.code == FaultCode::kTurnStalled);
  EXPECT_EQ(fault.joint, 2);
  EXPECT_EQ(fault.line, 5);
  EXPECT_NEAR(fault.asked, -90, 1e-4);
  EXPECT_NEAR(fault.measured, 0, 1e-4);
  EXPECT_NEAR(fault.limit, 9, 1e-4);
  EXPECT_EQ(vms.state(0).role.fields[0].AsInt(), 1);
  // Set free and blocked again, it stalls again.
  vms.Block(0, 2, false);
  vms.Tick(10);
  vms.Block(0, 2, true);
  vms.Tick(100);
  EXPECT_EQ(vms.CountFaults(FaultCode::kTurnStalled), 2);
}

TEST_F(TasksTest, AWheelIsSlowBelowATenthOfTheSpeedAskedAndNotAbove) {
  for (const double share : {0.09, 0.11, -1.0}) {
    VmRobot& vms = Lone("startup s() { self.turnContinuous(self.SPIN, 90); }", 1);
    vms.Block(0, 2, true);
    for (int i = 0; i < 100; ++i) {
      vms.joints()[0][2] += share * 90 * kDegree * 0.02;
      vms.Tick();
    }
    EXPECT_EQ(vms.CountFaults(FaultCode::kTurnStalled), share < 0.1 ? 1 : 0) << share;
  }
}

TEST_F(TasksTest, AWheelThatTremblesOnTheSpotIsStalled) {
  VmRobot& vms = Lone("startup s() { self.turnContinuous(self.SPIN, 90); }", 1);
  vms.Block(0, 2, true);
  for (int i = 0; i < 100; ++i) {
    vms.joints()[0][2] = (i % 2 == 0 ? 0.5 : -0.5) * kDegree;
    vms.Tick();
  }
  EXPECT_EQ(vms.CountFaults(FaultCode::kTurnStalled), 1);
}

TEST_F(TasksTest, SleepCountsSimTime) {
  Lone("startup s() { self.sleepcs(25); self.jointRotateDegreesNonBlocking(self.TURN, 5); }");
  TakeRole();
  vms_->Tick(12);
  EXPECT_NEAR(Target(), 0, 1e-9);
  vms_->Tick();  // 260 ms: the first tick at or after 250.
  EXPECT_NEAR(Target(), 5, 1e-9);
}

TEST_F(TasksTest, AnEndlessLoopIsToldWithItsLineAndStarvesNobody) {
  VmRobot& vms = Lone(R"(  behavior loop() {
    var i = 0;
    while (true) i = 1;
  }
  behavior works() { self.jointRotateDegrees(self.TURN, 1); self.sleepcs(2); })");
  vms.Tick(200);
  EXPECT_EQ(vms.CountFaults(FaultCode::kBudget), 1);
  EXPECT_EQ(vms.faults()[0].fault.line, 4);
  EXPECT_EQ(vms.faults()[0].fault.role, 0);
  const std::string name(vms.program().function(vms.faults()[0].fault.function).name.data,
                         vms.program().function(vms.faults()[0].fault.function).name.size);
  EXPECT_EQ(name, "R.loop");
  EXPECT_GT(Target(), 40);
}

TEST_F(TasksTest, AnEmptyBehaviorIsNoRunaway) {
  Lone("behavior nothing() { } behavior works() { self.jointRotateDegrees(self.TURN, 1); }");
  vms_->Tick(100);
  EXPECT_TRUE(vms_->faults().empty());
  EXPECT_GT(Target(), 30);
}

TEST_F(TasksTest, AFaultEndsItsTaskAndNoOther) {
  VmRobot& vms = Lone(R"(  zero = 0;
  behavior bad() {
    self.sleepcs(1);
    zero = 1 / zero;
  }
  behavior works() { self.jointRotateDegrees(self.TURN, 1); })");
  vms.Tick(100);
  ASSERT_EQ(vms.faults().size(), 1u);
  EXPECT_TRUE(vms.faults()[0].fault.code == FaultCode::kDivisionByZero);
  EXPECT_EQ(vms.faults()[0].fault.line, 5);
  EXPECT_GT(Target(), 30);
  EXPECT_EQ(vms.output(0).status.num_tasks, 1);
}

TEST_F(TasksTest, AFailedStartupKeepsEverythingElseFromStarting) {
  VmRobot& vms = Lone(R"(
  startup s() { self.turnContinuous(self.TURN, 5); }
  behavior b() { self.jointRotateDegrees(self.TURN, 1); }
)");
  vms.Tick(100);
  EXPECT_EQ(vms.CountFaults(FaultCode::kNotContinuous), 1);
  EXPECT_NEAR(Target(), 0, 1e-9);
  EXPECT_EQ(vms.output(0).status.num_tasks, 0);
}

TEST_F(TasksTest, HandlersRunOnTheTimerOnConnectAndOnDisconnect) {
  robot_ = test::ChainRobot(model_, 2);
  VmRobot vms(model_, robot_,
              test::ProgramFrom(R"(
role R extends Module {
  timer = 0; on = 0; off = 0;
  handler on_timer() { timer += 1; }
  handler on_connect() { on += 1; }
  handler on_disconnect() { off += 1; }
}
)",
                                model_));
  vms.Tick(30);
  const auto field = [&](int i) { return vms.state(0).role.fields[i].AsInt(); };
  EXPECT_EQ(field(1), 0);
  vms.SetDocked(0, false);
  vms.Tick(3);
  EXPECT_EQ(field(2), 1);
  vms.SetDocked(0, true);
  vms.Tick(3);
  EXPECT_EQ(field(1), 1);
  vms.Tick(250);
  EXPECT_GE(field(0), 4);
  EXPECT_LE(field(0), 6);
}

TEST_F(TasksTest, CommandsWaitForTheStartupAndBehindTheSameCommandEightDeep) {
  VmRobot& vms = Lone(R"(
  startup s() { self.sleepds(5); }
  command step() { self.jointRotateDegreesNonBlocking(self.TURN, 1); self.sleepds(3); }
)");
  TakeRole();
  InvokeRequest request;
  request.program_hash = vms.program().hash();
  for (int i = 0; i < 12; ++i) vms.Request(0, request);
  vms.Tick(10);
  EXPECT_NEAR(Target(), 0, 1e-9);
  EXPECT_EQ(vms.CountFaults(FaultCode::kQueueOverflow), 4);
  vms.Tick(30);
  EXPECT_GE(Target(), 1 - 1e-9);
  EXPECT_LE(Target(), 2 + 1e-9);  // One after the other, not all at once.
  vms.Tick(200);
  EXPECT_NEAR(Target(), 8, 1e-9);
  // Now one runs and eight wait.
  for (int i = 0; i < 12; ++i) vms.Request(0, request);
  vms.Tick(300);
  EXPECT_EQ(vms.CountFaults(FaultCode::kQueueOverflow), 4 + 3);
  EXPECT_NEAR(Target(), 17, 1e-9);
}

TEST_F(TasksTest, RequestsUnderAnotherImageOrForUnknownCommandsAreFaults) {
  VmRobot& vms =
      Lone("command step(n) { self.jointRotateDegreesNonBlocking(self.TURN, n * 1.0); }");
  TakeRole();
  InvokeRequest request;
  vms.Request(0, request);
  request.program_hash = vms.program().hash();
  request.command = 1;
  vms.Request(0, request);
  request.command = 0;
  request.role = 9;
  vms.Request(0, request);
  request.role = 0;
  vms.Request(0, request);  // An argument is missing.
  vms.Tick(3);
  EXPECT_EQ(vms.CountFaults(FaultCode::kBadInvocation), 4);
  EXPECT_NEAR(Target(), 0, 1e-9);
}

TEST_F(TasksTest, ConventionsTurnTheNamedLinkAboutTheNamedAxis) {
  // The hinge's axis is (0, 0.6, 0.8): 37 degrees off east, 53 off up, and square to north.
  VmRobot& vms = Lone(R"(
  startup s() {
    self.setJointAxis(self.TURN, $LINK_ONE, $EAST_WEST);
    self.jointSetDegrees(self.TURN, 10);
    self.setJointAxis(self.TURN, $LINK_TWO, $EAST_WEST);
    self.jointSetDegrees(self.TURN, 20);
    self.setJointAxis(self.TURN, $LINK_TWO, $UP_DOWN);
    self.jointSetDegrees(self.TURN, 30);
    self.setJointAxis(self.TURN, $LINK_TWO, $NORTH_SOUTH);
    self.jointSetDegrees(self.TURN, 40);
  }
)");
  EXPECT_EQ(Targets(80), (std::vector<int>{0, 10, -20, -30}));
  ASSERT_EQ(vms.faults().size(), 1u);
  const Fault& fault = vms.faults()[0].fault;
  EXPECT_TRUE(fault.code == FaultCode::kAxisNotAligned);
  EXPECT_EQ(fault.line, 10);
  EXPECT_EQ(fault.joint, 0);
  EXPECT_EQ(fault.link, 1);
  EXPECT_TRUE(fault.asked_axis == Axis::kNorthSouth);
  EXPECT_NEAR(fault.measured, 90, 0.01);
  EXPECT_NEAR(fault.limit, 75, 0.01);
  EXPECT_NEAR(fault.direction_R.z, -0.8, 1e-5);
}

TEST_F(TasksTest, AFaultSpeaksInTheSignInWhichTheProgramAsked) {
  VmRobot& vms = Lone(R"(
  startup s() {
    self.setJointAxis(self.TURN, $LINK_TWO, $EAST_WEST);
    self.jointSetDegrees(self.TURN, 100);
    self.TURN.SET_POSITION(95);
  }
)");
  vms.Tick(80);
  ASSERT_EQ(vms.faults().size(), 2u);
  EXPECT_NEAR(vms.faults()[0].fault.asked, 100, 1e-4);
  EXPECT_NEAR(vms.faults()[0].fault.limit, 90, 1e-4);
  EXPECT_NEAR(Target(), 90, 1e-4) << "a raw position knows no convention";
  EXPECT_NEAR(vms.faults()[1].fault.asked, 95, 1e-4);
  EXPECT_NEAR(vms.faults()[1].fault.limit, 90, 1e-4);
}

TEST_F(TasksTest, DegreesOfAPrismaticJointAreAFaultOfTheirOwn) {
  // Through a parameter, of which the compiler cannot tell whether it turns.
  VmRobot& vms = Lone(
      "startup s() { turn(self.SLIDE); } function turn(joint j) { self.jointSetDegrees(j, 10); }",
      1);
  vms.Tick(30);
  ASSERT_EQ(vms.faults().size(), 1u);
  EXPECT_TRUE(vms.faults()[0].fault.code == FaultCode::kNotRotary);
  EXPECT_EQ(vms.faults()[0].fault.joint, 1);
  EXPECT_EQ(vms.faults()[0].fault.line, 2);
}

TEST_F(TasksTest, MillimetresOfARotaryJointAndMotionOfAFixedOneAreFaultsOfTheirOwn) {
  VmRobot& vms = Lone(R"(
  behavior a() { move(self.SPIN); }
  function move(joint j) { self.jointMoveMillimetres(j, 10); }
  behavior b() { self.FIXED.SET_POSITION(10); }
)",
                      1);
  vms.Tick(30);
  EXPECT_EQ(vms.CountFaults(FaultCode::kNotPrismatic), 1);
  EXPECT_EQ(vms.CountFaults(FaultCode::kFixedJoint), 1);
}

TEST_F(TasksTest, ALinkThatTheJointDoesNotTouchIsAFault) {
  VmRobot& vms = Lone("startup s() { self.setJointAxis(self.SPIN, $LINK_BASE, $NORTH_SOUTH); }", 1);
  vms.Tick(30);
  EXPECT_EQ(vms.CountFaults(FaultCode::kLinkNotOnJoint), 1);
}

TEST_F(TasksTest, ContinuousJointsTurnWithoutEndAndStopWhereTheyAre) {
  VmRobot& vms = Lone(R"(
  startup s() {
    self.turnContinuous(self.SPIN, 90);
    self.sleepds(100);
    self.turnContinuous(self.SPIN, 0);
    self.sleepds(5);
    self.jointRotateDegrees(self.SPIN, 30);
    self.turnContinuous(self.SPIN, 100000);
  }
)",
                      1);
  TakeRole();
  vms.Tick(500);
  EXPECT_NEAR(vms.joints()[0][2] / kDegree, 900, 2);
  const double stopped = vms.joints()[0][2];
  EXPECT_TRUE(vms.output(0).joints[2].mode == ActuatorMode::kPosition);
  EXPECT_NEAR(vms.output(0).joints[2].target, stopped, 1e-9);
  vms.Tick(26);
  EXPECT_NEAR(vms.output(0).joints[2].target, stopped + 30 * kDegree, 1e-9);
  vms.Tick(30);
  EXPECT_TRUE(vms.output(0).joints[2].mode == ActuatorMode::kVelocity);
  EXPECT_EQ(vms.CountFaults(FaultCode::kSpeedClamped), 1);  // Faster than the joint can.
}

TEST_F(TasksTest, RawPositionsKnowNoConvention) {
  Lone(R"(
  startup s() {
    self.setJointAxis(self.TURN, $LINK_TWO, $EAST_WEST);
    self.TURN.SET_POSITION(33);
  }
)");
  TakeRole();
  EXPECT_NEAR(Target(), 33, 1e-9);
}

TEST_F(TasksTest, TargetsOfAColdStartAreTheMeasuredAngles) {
  VmRobot& vms = Lone("require sizeof(self.connected) == 9;");
  vms.joints()[0][0] = 0.4;
  vms.Tick(5);
  EXPECT_NEAR(vms.output(0).joints[0].target, 0.4, 1e-12);
  vms.Block(0, 0, true);
  vms.joints()[0][0] = 0.7;
  vms.ColdStart(0);
  vms.Tick();
  EXPECT_NEAR(vms.output(0).joints[0].target, 0.7, 1e-12);
}

TEST_F(TasksTest, ConnectorStatesGoOutAsCommands) {
  const model::Model mtran = test::ModelFrom("models/mtran.m3l");
  model::Robot robot = *mtran.FindRobot("quadruped");
  robot.modules.resize(1);
  robot.dockings.clear();
  robot.root_module = 0;
  VmRobot vms(mtran, robot,
              test::ProgramFrom(
                  "role R extends Module { startup s() { self.C2.SET_EXTENDED(true); } }", mtran));
  for (int i = 0; i < 30 && vms.output(0).status.role < 0; ++i) vms.Tick();
  ASSERT_EQ(vms.output(0).num_connector_commands, 1);
  EXPECT_EQ(vms.output(0).connector_commands[0].connector, 1);
  EXPECT_EQ(vms.output(0).connector_commands[0].state, 0);
  EXPECT_EQ(vms.output(0).connector_commands[0].value, 1);
  vms.Tick();
  EXPECT_EQ(vms.output(0).num_connector_commands, 0);
}

}  // namespace
}  // namespace morphbus::vm
