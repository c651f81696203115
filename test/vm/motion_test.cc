// Motion: in which sign and unit joints are moved, and what connectors are told.

#include "test/vm/lone_module.h"

namespace morphbus::vm {
namespace {

using MotionTest = LoneModuleTest;

TEST_F(MotionTest, ConventionsTurnTheNamedLinkAboutTheNamedAxis) {
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

TEST_F(MotionTest, EffortIsReadInTheConventionsSign) {
  VmRobot& vms = Lone(R"(
  startup s() {
    if (self.jointEffort(self.TURN) == 1.5) self.jointSetDegrees(self.TURN, 5);
    self.setJointAxis(self.TURN, $LINK_ONE, $EAST_WEST);
    if (self.jointEffort(self.TURN) == 1.5) self.jointSetDegrees(self.TURN, 10);
    self.setJointAxis(self.TURN, $LINK_TWO, $EAST_WEST);
    if (self.jointEffort(self.TURN) == -1.5) self.jointSetDegrees(self.TURN, 20);
    self.sleepds(10);
    if (self.jointEffort(self.TURN) == 0.25) self.jointSetDegrees(self.TURN, 40);
  }
)");
  vms.efforts(0)[0] = 1.5F;
  EXPECT_EQ(Targets(70), (std::vector<int>{0, 5, 10, -20}));
  // It is that of the present tick.
  vms.efforts(0)[0] = -0.25F;
  EXPECT_EQ(Targets(60).back(), -40);
}

TEST_F(MotionTest, VelocityIsReadInTheConventionsSign) {
  VmRobot& vms = Lone(R"(
  first = 0.0; one = 0.0; two = 0.0;
  startup s() {
    self.jointSetDegreesNonBlocking(self.TURN, 60);
    self.sleepcs(6);
    first = self.jointVelocity(self.TURN);
    self.setJointAxis(self.TURN, $LINK_ONE, $EAST_WEST);
    one = self.jointVelocity(self.TURN);
    self.setJointAxis(self.TURN, $LINK_TWO, $EAST_WEST);
    two = self.jointVelocity(self.TURN);
    print(first, one, two);
  }
)");
  TakeRole();
  vms.Tick(10);
  const Cell* fields = vms.state(0).role.fields;
  const double speed = model_.module_types[0].joints[0].speed * 180 / M_PI;
  EXPECT_NEAR(fields[0].AsFloat(), speed, 0.01);
  EXPECT_NEAR(fields[1].AsFloat(), speed, 0.01);
  EXPECT_NEAR(fields[2].AsFloat(), -speed, 0.01);
}

TEST_F(MotionTest, PrismaticJointsHaveVelocitiesInMillimetresASecond) {
  VmRobot& vms = Lone(R"(
  first = 0.0;
  startup s() {
    self.jointSetMillimetresNonBlocking(self.SLIDE, 40);
    self.sleepcs(6);
    first = self.jointVelocity(self.SLIDE);
    print(first);
  }
)",
                      1);
  TakeRole();
  vms.Tick(10);
  EXPECT_NEAR(vms.state(0).role.fields[0].AsFloat(), model_.module_types[1].joints[1].speed * 1000,
              0.01);
}

TEST_F(MotionTest, PrismaticJointsHaveEffortsAndFixedOnesDoNot) {
  VmRobot& vms = Lone(R"(
  startup s() {
    if (self.jointEffort(self.SLIDE) == 9.75) self.jointSetMillimetresNonBlocking(self.SLIDE, 10);
    if (self.jointEffort(self.FIXED) == 0) self.jointSetMillimetresNonBlocking(self.SLIDE, 20);
  }
)",
                      1);
  vms.efforts(0)[1] = 9.75F;
  vms.Tick(30);
  EXPECT_NEAR(vms.output(0).joints[1].target, 0.01, 1e-9);
  EXPECT_EQ(vms.CountFaults(FaultCode::kFixedJoint), 1);
}

TEST_F(MotionTest, AFaultSpeaksInTheSignInWhichTheProgramAsked) {
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

TEST_F(MotionTest, DegreesOfAPrismaticJointAreAFaultOfTheirOwn) {
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

TEST_F(MotionTest, MillimetresOfARotaryJointAndMotionOfAFixedOneAreFaultsOfTheirOwn) {
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

TEST_F(MotionTest, ALinkThatTheJointDoesNotTouchIsAFault) {
  VmRobot& vms = Lone("startup s() { self.setJointAxis(self.SPIN, $LINK_BASE, $NORTH_SOUTH); }", 1);
  vms.Tick(30);
  EXPECT_EQ(vms.CountFaults(FaultCode::kLinkNotOnJoint), 1);
}

TEST_F(MotionTest, ContinuousJointsTurnWithoutEndAndStopWhereTheyAre) {
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

TEST_F(MotionTest, RawPositionsKnowNoConvention) {
  Lone(R"(
  startup s() {
    self.setJointAxis(self.TURN, $LINK_TWO, $EAST_WEST);
    self.TURN.SET_POSITION(33);
  }
)");
  TakeRole();
  EXPECT_NEAR(Target(), 33, 1e-9);
}

TEST_F(MotionTest, TargetsOfAColdStartAreTheMeasuredAngles) {
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

TEST_F(MotionTest, ConnectorStatesGoOutAsCommands) {
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
