// What the language offers of the module and the robot, on whole VMs: the root's clock, random
// numbers, prismatic joints, states of connectors.

#include <set>

#include "test/vm/lone_module.h"

namespace morphbus::vm {
namespace {

using LanguageTest = LoneModuleTest;

constexpr char kReadsClock[] = R"(
role R extends Module {
  ms = 0; hops = 0; seconds = 0.0;
  behavior b() { ms = self.ms; seconds = self.time; hops = self.hops; }
}
)";

int32_t Field(VmRobot& vms, int module, int slot) {
  return vms.state(module).role.fields[slot].AsInt();
}

TEST_F(LanguageTest, AllModulesReadTheRootsTimeInTheSameTick) {
  robot_ = test::ChainRobot(model_, 6);
  VmRobotOptions options;
  options.root = 2;
  VmRobot vms(model_, robot_, test::ProgramFrom(kReadsClock, model_), options);
  vms.Tick(60);
  for (int tick = 0; tick < 20; ++tick) {
    vms.Tick();
    for (int m = 0; m < vms.size(); ++m) {
      EXPECT_EQ(Field(vms, m, 0), static_cast<int>(vms.tick()) * 20) << m;
      EXPECT_FLOAT_EQ(vms.state(m).role.fields[2].AsFloat(),
                      static_cast<float>(vms.tick()) * 0.02f);
      EXPECT_EQ(Field(vms, m, 1), std::abs(m - 2)) << m;
    }
  }
}

// The clock of a module whose own one is behind: what it has heard of the root's counts.
TEST_F(LanguageTest, AModuleWhoseOwnClockIsBehindReadsTheRootsTime) {
  VmRobot& vms = Lone("ms = 0; behavior b() { ms = self.ms; }");
  TakeRole();
  vms.state(0).pose.clock_ahead = 500;
  vms.state(0).pose.has = true;
  // The root sets its own clock anew in each tick, so the module must be another's.
  VmRobotOptions options;
  robot_ = test::ChainRobot(model_, 2);
  VmRobot two(model_, robot_, test::ProgramFrom(kReadsClock, model_), options);
  two.Tick(40);
  two.state(1).pose.clock_ahead += 500;
  two.Tick();
  EXPECT_EQ(Field(two, 1, 0), (static_cast<int>(two.tick()) + 500) * 20);
}

constexpr char kDraws[] = R"(
role R extends Module {
  x = 0.0;
  behavior b() { x = random(-2, 6); }
}
)";

std::vector<float> Draws(VmRobot& vms, int module) {
  std::vector<float> draws;
  for (int i = 0; i < 200; ++i) {
    vms.Tick();
    draws.push_back(vms.state(module).role.fields[0].AsFloat());
  }
  return draws;
}

TEST_F(LanguageTest, RandomNumbersRepeatAndDifferFromModuleToModule) {
  robot_ = test::ChainRobot(model_, 3);
  const auto program = test::ProgramFrom(kDraws, model_);
  std::vector<std::vector<float>> runs;
  for (const int module : {0, 1, 0}) {
    VmRobot vms(model_, robot_, program);
    vms.Tick(60);
    runs.push_back(Draws(vms, module));
  }
  EXPECT_EQ(runs[0], runs[2]);
  EXPECT_NE(runs[0], runs[1]);
  double sum = 0;
  for (const float x : runs[0]) {
    EXPECT_GE(x, -2);
    EXPECT_LE(x, 6);
    sum += static_cast<double>(x);
  }
  EXPECT_EQ(std::set<float>(runs[0].begin(), runs[0].end()).size(), 200u);
  // Six standard deviations of the mean of 200 even draws from a range of 8.
  EXPECT_NEAR(sum / 200, 2, 6 * 8 / std::sqrt(12.0 * 200));
  // Another life draws other numbers; a snapshot goes on where it was.
  VmRobot vms(model_, robot_, program);
  vms.Tick(30);
  vms.SaveAndRestore(0);
  vms.Tick(30);
  EXPECT_EQ(Draws(vms, 0), runs[0]);
  vms.ColdStart(0);
  vms.Tick(60);
  EXPECT_NE(Draws(vms, 0), runs[0]);
}

TEST_F(LanguageTest, PrismaticJointsHaveEveryCallThatRevoluteOnesHave) {
  VmRobot& vms = Lone(R"(
  read = 0.0;
  startup s() {
    self.jointSetMillimetres(self.SLIDE, 30);
    read = self.jointMillimetres(self.SLIDE);
    self.jointMoveMillimetresNonBlocking(self.SLIDE, -10);
    self.jointSetMillimetresNonBlocking(self.SLIDE, self.jointMillimetres(self.SLIDE) + 5);
  })",
                      1);
  TakeRole();
  EXPECT_NEAR(vms.output(0).joints[1].target, 0.030, 1e-9);
  vms.Tick(60);
  EXPECT_NEAR(vms.state(0).role.fields[0].AsFloat(), 30, 1);
  // The last call counts from where the joint was in that tick.
  EXPECT_NEAR(vms.output(0).joints[1].target,
              (static_cast<double>(vms.state(0).role.fields[0].AsFloat()) + 5) / 1000, 1e-6);
  EXPECT_TRUE(vms.faults().empty());
}

TEST_F(LanguageTest, AJointThatTurnsHasNoMillimetres) {
  for (const char* call :
       {"self.jointSetMillimetres(j, 5);", "self.sleepds(self.jointMillimetres(j));",
        "self.jointMoveMillimetresNonBlocking(j, 5);"}) {
    VmRobot& vms = Lone(std::string("function f(joint j) { ") + call +
                        " }\n label either = self.joints($ANY, 0); startup s() { f(either); }");
    vms.Tick(40);
    ASSERT_EQ(vms.faults().size(), 1u) << call;
    EXPECT_TRUE(vms.faults()[0].fault.code == FaultCode::kNotPrismatic) << call;
  }
}

// Molecube's joints lie along diagonals of the cube, which no named axis is near.
TEST(DiagonalsTest, MolecubesJointsLieAlongDiagonals) {
  const model::Model molecube = test::ModelFrom("models/molecube.m3l");
  const auto program = test::ProgramFrom(R"(
role Cube extends Module {
  require self.SWIVEL.AXIS != $ANY && self.SWIVEL.AXIS != $UP_DOWN;
  require self.SWIVEL.AXIS != $NORTH_SOUTH && self.SWIVEL.AXIS != $EAST_WEST;
  startup s() {
    self.setJointAxis(self.SWIVEL, $LINK_UPPER, self.SWIVEL.AXIS);
    self.jointSetDegrees(self.SWIVEL, 30);
  }
}
role Along extends Cube {
  require self.joints(axis($NORTH + $UP + $EAST), 0) == 1 || self.joints(axis($NORTH + $UP + $EAST), 1) == 1 ||
          self.joints(axis($NORTH + $UP + $EAST), 2) == 1;
}
)",
                                         molecube);
  VmRobot vms(molecube, *molecube.FindRobot("snake"), program);
  vms.Tick(60);
  int along = 0;
  for (int m = 0; m < vms.size(); ++m) {
    EXPECT_NE(vms.RoleOf(m), "") << m;
    EXPECT_NE(vms.output(m).status.signs[0], 0) << m;
    along += vms.RoleOf(m) == "Along" ? 1 : 0;
  }
  EXPECT_TRUE(vms.faults().empty());
  EXPECT_LT(along, vms.size() + 1);
}

TEST_F(LanguageTest, ConnectorsKnowWhatIsDocked) {
  robot_ = test::ChainRobot(model_, 2);
  VmRobot vms(model_, robot_,
              test::ProgramFrom(R"(
role Left extends Module {
  require self.C5.CONNECTED && !self.C0.CONNECTED;
}
role Right extends Module {
  require self.C0.CONNECTED;
}
)",
                                model_));
  vms.Tick(40);
  EXPECT_EQ(vms.RoleOf(0), "Left");
  EXPECT_EQ(vms.RoleOf(1), "Right");
}

}  // namespace
}  // namespace morphbus::vm
