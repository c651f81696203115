// Tasks: which of a program's statements run when, and what their faults say.

#include <algorithm>

#include "test/vm/lone_module.h"
#include "vm/image/fault_text.h"

namespace morphbus::vm {
namespace {

using TasksTest = LoneModuleTest;

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
  const Text name = vms.program().function_name(vms.faults()[0].fault.function);
  EXPECT_EQ(std::string(name.data, name.size), "R.loop");
  EXPECT_GT(Target(), 40);
}

TEST_F(TasksTest, AnEmptyBehaviorIsNoRunaway) {
  Lone("behavior nothing() { } behavior works() { self.jointRotateDegrees(self.TURN, 1); }");
  vms_->Tick(100);
  EXPECT_TRUE(vms_->faults().empty());
  EXPECT_GT(Target(), 30);
}

/// By how much the role's first field grows in `ticks` ticks.
int Rounds(VmRobot& vms, int ticks) {
  const int before = vms.state(0).role.fields[0].AsInt();
  vms.Tick(ticks);
  return vms.state(0).role.fields[0].AsInt() - before;
}

TEST_F(TasksTest, ARoundOfABehaviorTakesAsLongAsItSleeps) {
  // Two hundredths of a second are one tick.
  VmRobot& fast = Lone("n = 0; behavior b() { n += 1; self.sleepcs(2); }");
  TakeRole();
  EXPECT_EQ(Rounds(fast, 50), 50) << "in a second";
  // Less than a tick lasts until the next one.
  VmRobot& less = Lone("n = 0; behavior b() { n += 1; self.sleepcs(1); }");
  TakeRole();
  EXPECT_EQ(Rounds(less, 50), 50);
  VmRobot& slow = Lone("n = 0; behavior b() { n += 1; self.sleepds(5); }");
  TakeRole();
  EXPECT_EQ(Rounds(slow, 500), 20) << "in ten seconds";
  EXPECT_TRUE(slow.faults().empty());
}

TEST_F(TasksTest, ARoundOfABehaviorTakesAsLongAsItsTurns) {
  // 36 degrees at 3.6 degrees a tick, there and back.
  VmRobot& vms = Lone(
      "n = 0; behavior b() { n += 1; self.jointRotateDegrees(self.TURN, 36); "
      "self.jointRotateDegrees(self.TURN, -36); }");
  TakeRole();
  EXPECT_EQ(Rounds(vms, 200), 10);
}

TEST_F(TasksTest, ARoundThatTookNoTimeGoesOnInTheNextTick) {
  VmRobot& empty = Lone("n = 0; behavior b() { n += 1; }");
  TakeRole();
  EXPECT_EQ(Rounds(empty, 50), 50);
  EXPECT_TRUE(empty.faults().empty());
  // No time at all ends in the next tick, too, and then the next round may begin there.
  VmRobot& none = Lone("n = 0; behavior b() { n += 1; self.sleepcs(0); }");
  TakeRole();
  EXPECT_EQ(Rounds(none, 50), 50);
  // Every other round waits: what follows it begins in the tick in which it ended.
  VmRobot& turns = Lone("n = 0; behavior b() { n += 1; if (n % 2 == 0) self.sleepcs(6); }");
  TakeRole();
  EXPECT_EQ(Rounds(turns, 400), 200);
  EXPECT_TRUE(turns.faults().empty());
}

TEST_F(TasksTest, ARoundThatTheBudgetCutsIsFollowedInTheTickInWhichItEnds) {
  // A round costs more than a tick's budget and less than two.
  VmRobot& vms = Lone("n = 0; behavior b() { var i = 0; while (i < 3000) i += 1; n += 1; }");
  TakeRole();
  const int rounds = Rounds(vms, 300);
  EXPECT_GT(vms.CountFaults(FaultCode::kBudget), 0);
  EXPECT_GT(rounds, 150) << "as many as the budget is enough for";
  EXPECT_LT(rounds, 300);
}

TEST_F(TasksTest, BehaviorsThatRepeatInOneTickRunInTurn) {
  // The later one sees each round of the first.
  VmRobot& vms = Lone(R"(
  n = 0; seen = 0; skipped = 0;
  behavior counts() { n += 1; self.sleepcs(2); }
  behavior watches() {
    if (n - seen > 1) skipped += 1;
    seen = n;
    self.sleepcs(2);
  }
)");
  TakeRole();
  EXPECT_EQ(Rounds(vms, 100), 100);
  EXPECT_EQ(vms.state(0).role.fields[1].AsInt(), vms.state(0).role.fields[0].AsInt());
  EXPECT_EQ(vms.state(0).role.fields[2].AsInt(), 0);
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

/// The name of a fault's task; empty if the fault has ended none.
std::string TaskOf(const VmRobot& vms, const Fault& fault) {
  return fault.ended_task < 0 ? "" : FaultTask(fault, &vms.program());
}

TEST_F(TasksTest, AFaultNamesTheTaskThatItHasEndedAndTheStatusCountsThoseThatAreDead) {
  // One dies by an instruction and one by what it asks of the module, in a function that it calls;
  // the handler and the command that fault run again.
  VmRobot& vms = Lone(R"(
  zero = 0;
  behavior lives() { self.sleepcs(2); }
  behavior divides() { zero = 1 / zero; }
  function asks() { self.turnContinuous(self.TURN, 1); }
  behavior calls() { self.asks(); }
  handler rings() every 0.1 { zero = 1 / zero; }
  command kick() { zero = 1 / zero; }
)");
  TakeRole();
  InvokeRequest request;
  request.program_hash = vms.program().hash();
  vms.Request(0, request);
  vms.Tick(12);
  std::vector<std::string> ended;
  for (const VmRobot::FaultEvent& event : vms.faults()) {
    const Fault& fault = event.fault;
    ended.push_back(std::string(TaskKindName(static_cast<TaskKind>(fault.ended_task))) + " " +
                    TaskOf(vms, fault) + " in " + FaultFunction(fault, &vms.program()));
  }
  std::sort(ended.begin(), ended.end());
  EXPECT_EQ(ended,
            (std::vector<std::string>{"behavior R.calls in R.asks",
                                      "behavior R.divides in R.divides", "command R.kick in R.kick",
                                      "handler R.rings in R.rings", "handler R.rings in R.rings"}));
  EXPECT_EQ(vms.output(0).status.ended_behaviors, 2);
  EXPECT_FALSE(vms.output(0).status.startup_ended);
}

TEST_F(TasksTest, AFaultThatLeavesItsTaskRunningHasEndedNone) {
  VmRobot& vms = Lone("behavior b() { self.jointSetDegrees(self.TURN, 95); self.sleepds(1); }");
  vms.Tick(40);
  ASSERT_GE(vms.CountFaults(FaultCode::kTargetClamped), 1);
  EXPECT_EQ(TaskOf(vms, vms.faults()[0].fault), "");
  EXPECT_EQ(vms.output(0).status.ended_behaviors, 0);
}

TEST_F(TasksTest, AStartupThatFaultsIsToldForAsLongAsTheRoleIsHeld) {
  VmRobot& vms = Lone(R"(
  zero = 0;
  startup first() { self.sleepcs(10); }
  startup second() { zero = 1 / zero; }
  behavior never() { self.jointRotateDegrees(self.TURN, 1); }
)");
  TakeRole();
  EXPECT_FALSE(vms.output(0).status.startup_ended);  // It sleeps.
  vms.Tick(20);
  ASSERT_EQ(vms.faults().size(), 1u);
  EXPECT_EQ(vms.faults()[0].fault.ended_task, static_cast<int8_t>(TaskKind::kStartup));
  EXPECT_EQ(TaskOf(vms, vms.faults()[0].fault), "R.second");
  EXPECT_TRUE(vms.output(0).status.startup_ended);
  EXPECT_EQ(vms.output(0).status.ended_behaviors, 0);
  EXPECT_NEAR(Target(), 0, 1e-9);
}

}  // namespace
}  // namespace morphbus::vm
