#include "vm/spread/diffusion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "test/support/compiled.h"
#include "test/support/toy_model.h"
#include "test/support/vm_robot.h"

namespace morphbus::vm {
namespace {

using test::VmRobot;
using test::VmRobotOptions;

/// Every step that a module runs turns its joint by one degree, so the target counts them.
constexpr char kCounting[] = R"(
role Any extends Module {
  command step() { self.jointRotateDegreesNonBlocking(self.TURN, 1); }
  command far(n) { self.jointRotateDegreesNonBlocking(self.TURN, n); }
}
)";

class DiffusionTest : public ::testing::TestWithParam<uint64_t> {
 protected:
  /// Robots of Hinges only, all joints at 0.
  void Build(model::Robot robot, const VmRobotOptions& options, const char* program = kCounting) {
    robot_ = std::move(robot);
    for (model::ModuleInstance& module : robot_.modules) module.start = {0.0};
    vms_ = std::make_unique<VmRobot>(model_, robot_, test::ProgramFrom(program, model_), options);
  }
  model::Robot RandomHinges(int modules, int loops) {
    for (uint64_t seed = GetParam() * 1000;; ++seed) {
      model::Robot robot = test::RandomRobot(model_, modules, loops, seed);
      bool hinges = true;
      for (const model::ModuleInstance& module : robot.modules) hinges &= module.type == 0;
      if (hinges) return robot;
    }
  }
  void Step(int module) {
    InvokeRequest request;
    request.program_hash = vms_->program().hash();
    vms_->Request(module, request);
  }
  [[nodiscard]] int Count(int module) const {
    return static_cast<int>(std::lround(vms_->output(module).joints[0].target * 180 / M_PI));
  }
  const model::Model model_ = test::ToyModel();
  model::Robot robot_;
  std::unique_ptr<VmRobot> vms_;
};

TEST_P(DiffusionTest, EachInvocationRunsExactlyOnceOnEachModuleWhateverTheLinksLose) {
  VmRobotOptions options;
  options.loss = 0.3;
  options.late = 0.3;
  options.grace_ticks = 30;
  options.seed = GetParam();
  Build(RandomHinges(7, 5), options);
  vms_->Tick(200);
  for (int m = 0; m < 7; ++m) ASSERT_EQ(vms_->RoleOf(m), "Any");
  std::mt19937_64 random(GetParam());
  int issued = 0;
  for (int i = 0; i < 80; ++i) {
    Step(static_cast<int>(random() % 7));
    ++issued;
    vms_->Tick(static_cast<int>(random() % 8));
  }
  vms_->Tick(400);
  for (int m = 0; m < 7; ++m) {
    EXPECT_EQ(Count(m), issued) << "module " << m;
    EXPECT_EQ(vms_->state(m).diffusion.num_kept, 0);
  }
  EXPECT_TRUE(vms_->faults().empty());
}

TEST_P(DiffusionTest, WithoutLossItArrivesAtOneHopATick) {
  Build(test::ChainRobot(model_, 12), {});
  vms_->Tick(60);
  Step(3);
  vms_->Tick();
  EXPECT_EQ(Count(3), 1);
  for (int hop = 1; hop <= 8; ++hop) {
    EXPECT_EQ(Count(3 + hop), 0);
    vms_->Tick();
    EXPECT_EQ(Count(3 + hop), 1);
  }
  vms_->Tick(10);
  for (int m = 0; m < 12; ++m) {
    EXPECT_EQ(Count(m), 1);
    EXPECT_EQ(vms_->state(m).diffusion.num_kept, 0);
  }
}

TEST_P(DiffusionTest, APartDockedLaterHearsOnlyWhatIsIssuedFromThenOn) {
  Build(test::ChainRobot(model_, 6), {});
  vms_->SetDocked(2, false);
  vms_->Tick(60);
  for (int i = 0; i < 5; ++i) Step(0);
  vms_->Tick(20);
  vms_->SetDocked(2, true);
  vms_->Tick(60);
  EXPECT_EQ(Count(2), 5);
  EXPECT_EQ(Count(3), 0);
  for (int i = 0; i < 3; ++i) Step(0);
  vms_->Tick(30);
  for (int m = 0; m < 3; ++m) EXPECT_EQ(Count(m), 8);
  for (int m = 3; m < 6; ++m) EXPECT_EQ(Count(m), 3);
}

TEST_P(DiffusionTest, APartThatWasAwayGoesOnAfterTheGap) {
  Build(test::ChainRobot(model_, 4), {});
  vms_->Tick(60);
  Step(0);
  vms_->Tick(10);
  vms_->SetDocked(2, false);
  vms_->Tick(2);
  Step(0);
  Step(0);
  vms_->Tick(10);
  vms_->SetDocked(2, true);
  vms_->Tick(5);
  Step(0);
  vms_->Tick(static_cast<int>(kSilentTicks) + 20);
  Step(0);
  vms_->Tick(20);
  EXPECT_EQ(Count(2), 5);
  EXPECT_EQ(Count(3), 3);  // All but the two that passed while it was away.
}

TEST_P(DiffusionTest, ASilentNeighbourDoesNotHoldUpTheOthersForEver) {
  Build(test::ChainRobot(model_, 4), {});
  vms_->Tick(60);
  vms_->SetSilent(3, true);
  for (int i = 0; i < 40; ++i) {
    Step(0);
    vms_->Tick(4);
  }
  vms_->Tick(static_cast<int>(kSilentTicks) + 20);
  EXPECT_EQ(Count(2), 40);
  EXPECT_EQ(vms_->state(2).diffusion.num_kept, 0);
  EXPECT_EQ(vms_->CountFaults(FaultCode::kQueueOverflow), 0);
}

TEST_P(DiffusionTest, AnInvocationRunsOnlyUnderTheImageThatSentIt) {
  Build(test::ChainRobot(model_, 4), {});
  vms_->Tick(60);
  // The second module runs another program, whose command 0 would turn the joint, too.
  vms_->ReplaceProgram(
      1, test::ProgramFrom(std::string(kCounting) + "// another\n"
                                                    "role Other extends Module { require 1 > 2; }",
                           model_));
  vms_->Tick(60);
  ASSERT_EQ(vms_->output(1).status.role, 0);
  Step(0);
  vms_->Tick(10);
  EXPECT_EQ(Count(0), 1);
  EXPECT_EQ(Count(1), 0);
  EXPECT_EQ(Count(2), 1);  // Passed on all the same.
  EXPECT_EQ(Count(3), 1);
}

TEST_P(DiffusionTest, AModuleWithoutTheRoleForwardsAndForgets) {
  Build(test::ChainRobot(model_, 3), {}, R"(
role End extends Module {
  require sizeof(self.connected) == 1;
  command step() { self.jointRotateDegreesNonBlocking(self.TURN, 1); }
}
role Middle extends Module {
  require sizeof(self.connected) == 2;
  command step() { self.jointRotateDegreesNonBlocking(self.TURN, 50); }
}
)");
  vms_->Tick(60);
  Step(1);  // Role 0 is End; the middle module only issues it.
  vms_->Tick(10);
  EXPECT_EQ(Count(0), 1);
  EXPECT_EQ(Count(1), 0);
  EXPECT_EQ(Count(2), 1);
}

TEST_P(DiffusionTest, ACommandOfABaseRoleRunsOnItsSubrolesInTheirOwnWay) {
  Build(test::ChainRobot(model_, 2), {}, R"(
abstract role Base extends Module {
  size = 1.0;
  command step() { self.jointRotateDegreesNonBlocking(self.TURN, size); }
  command again() { self.jointRotateDegreesNonBlocking(self.TURN, 10); }
}
role Sub extends Base { size = 3.0; }
role Own extends Sub {
  command step() { self.jointRotateDegreesNonBlocking(self.TURN, -7); }
}
)");
  vms_->Tick(60);
  InvokeRequest request;
  request.program_hash = vms_->program().hash();
  request.role = static_cast<uint16_t>(vms_->RoleNamed("Base"));
  vms_->Request(0, request);
  vms_->Tick(10);
  EXPECT_EQ(vms_->RoleOf(1), "Own");
  EXPECT_EQ(Count(1), -7);
  request.command = 1;
  vms_->Request(0, request);
  vms_->Tick(10);
  EXPECT_EQ(Count(1), 3);
}

TEST_P(DiffusionTest, ArgumentsTravelWithTheInvocation) {
  Build(test::ChainRobot(model_, 3), {});
  vms_->Tick(60);
  InvokeRequest request;
  request.program_hash = vms_->program().hash();
  request.command = 1;
  request.num_arguments = 1;
  request.arguments[0] = Cell::Float(-33);
  vms_->Request(0, request);
  vms_->Tick(10);
  for (int m = 0; m < 3; ++m) EXPECT_EQ(Count(m), -33);
}

TEST_P(DiffusionTest, AColdStartedIssuerIsHeardAgainAndAColdStartedListenerRunsNothingTwice) {
  Build(test::ChainRobot(model_, 4), {});
  vms_->Tick(60);
  for (int i = 0; i < 3; ++i) Step(0);
  vms_->Tick(20);
  vms_->ColdStart(0);
  vms_->ColdStart(2);
  vms_->Tick(60);
  EXPECT_EQ(Count(2), 3);  // Its joint stands where it was; nothing has run again.
  EXPECT_EQ(Count(3), 3);
  Step(0);
  vms_->Tick(20);
  EXPECT_EQ(Count(0), 4);
  EXPECT_EQ(Count(1), 4);
  EXPECT_EQ(Count(2), 4);
  EXPECT_EQ(Count(3), 4);
}

TEST_P(DiffusionTest, TooManyUnderWayAreCountedAndTold) {
  Build(test::ChainRobot(model_, 3), {}, R"(
role Any extends Module { command step() { self.jointRotateDegreesNonBlocking(self.TURN, 1); } }
)");
  vms_->Tick(60);
  vms_->SetSilent(1, true);  // Nothing is acknowledged.
  for (int i = 0; i < 20; ++i) {
    Step(0);
    vms_->Tick(1);
  }
  EXPECT_EQ(vms_->CountFaults(FaultCode::kInvocationNotSent), 20 - kMaxInvocations / 2);
}

INSTANTIATE_TEST_SUITE_P(Seeds, DiffusionTest, ::testing::Range(uint64_t{1}, uint64_t{5}));

TEST(DiffusionCapacityTest, JamsOfManyIssuersResolve) {
  const model::Model model = test::ToyModel();
  model::Robot robot = test::ChainRobot(model, 20);
  for (model::ModuleInstance& module : robot.modules) module.start = {0.0};
  VmRobotOptions options;
  options.loss = 0.2;
  options.grace_ticks = 30;
  VmRobot vms(model, robot, test::ProgramFrom(kCounting, model), options);
  vms.Tick(300);
  InvokeRequest request;
  request.program_hash = vms.program().hash();
  for (int burst = 0; burst < 3; ++burst) {
    for (int m = 0; m < 20; ++m) vms.Request(m, request);
    vms.Tick(150);
  }
  vms.Tick(500);
  for (int m = 0; m < 20; ++m) {
    EXPECT_EQ(static_cast<int>(std::lround(vms.output(m).joints[0].target * 180 / M_PI)), 60);
    EXPECT_EQ(vms.state(m).diffusion.num_kept, 0);
  }
}

}  // namespace
}  // namespace morphbus::vm
