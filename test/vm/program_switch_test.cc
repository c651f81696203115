// What a module sees when another program takes the place of the one that runs.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "compiler/dynarole/parameters.h"
#include "test/vm/lone_module.h"
#include "vm/image/verifier.h"

namespace morphbus::vm {
namespace {

/// A role with a convention for its joint; `link` decides for which sign.
std::string WithConvention(const std::string& link, const std::string& more) {
  return "startup s() { self.setJointAxis(self.TURN, $LINK_" + link + ", $EAST_WEST); }\n" + more;
}

class ProgramSwitchTest : public LoneModuleTest {
 protected:
  /// Another program from the next tick on.
  void Replace(const std::string& program) {
    for (int m = 0; m < vms_->size(); ++m) {
      vms_->ReplaceProgram(m, test::ProgramFrom(program, model_));
    }
  }
  void ReplaceRole(const std::string& members) {
    Replace("role R extends Module {\n" + members + "\n}\n");
  }
  [[nodiscard]] int Sign() const { return vms_->output(0).status.signs[0]; }
};

TEST_F(ProgramSwitchTest, ARoleOfTheSameNameKeepsItsConventionWithoutATickBetween) {
  int signs = 0;
  for (const char* link : {"ONE", "TWO"}) {
    Lone(WithConvention(link, ""));
    TakeRole();
    vms_->Tick(5);
    const int sign = Sign();
    ASSERT_NE(sign, 0);
    signs += sign;
    // The new program sets none of its own: the call goes by the old one's.
    ReplaceRole("startup s() { self.jointSetDegreesNonBlocking(self.TURN, 10); }");
    vms_->Tick();
    EXPECT_EQ(vms_->output(0).status.role, 0);
    EXPECT_TRUE(vms_->output(0).status.changed) << "people are told of the other program";
    EXPECT_EQ(Sign(), sign);
    EXPECT_NEAR(Target(), 10.0 * sign, 1e-9);
  }
  EXPECT_EQ(signs, 0) << "one of each sign";
}

TEST_F(ProgramSwitchTest, JointsHoldTheirTargetsUntilTheNewProgramSaysOtherwise) {
  Lone("behavior b() { self.jointSetDegreesNonBlocking(self.TURN, 60); self.sleepds(100); }");
  TakeRole();
  vms_->Tick(3);
  ASSERT_NEAR(Target(), 60, 1e-9);
  ReplaceRole("startup s() { self.sleepds(10); self.jointSetDegreesNonBlocking(self.TURN, 20); }");
  // The joint goes on to its target, though the call that gave it is over.
  for (int i = 0; i < 50; ++i) {
    vms_->Tick();
    ASSERT_NEAR(Target(), 60, 1e-9) << "tick " << i;
  }
  EXPECT_NEAR(vms_->joints()[0][0] / kDegree, 60, 1e-6);
  vms_->Tick(2);
  EXPECT_NEAR(Target(), 20, 1e-9);
}

TEST_F(ProgramSwitchTest, AJointThatTurnsEndlesslyTurnsOnIfTheNewProgramSaysSoAtOnce) {
  for (const bool goes_on : {true, false}) {
    Lone("startup s() { self.turnContinuous(self.SPIN, 30); }", 1);
    TakeRole();
    vms_->Tick(5);
    ASSERT_EQ(vms_->output(0).joints[2].mode, ActuatorMode::kVelocity);
    ReplaceRole(goes_on ? "startup s() { self.turnContinuous(self.SPIN, 30); }"
                        : "startup s() { self.sleepds(1); }");
    vms_->Tick();
    EXPECT_EQ(vms_->output(0).joints[2].mode,
              goes_on ? ActuatorMode::kVelocity : ActuatorMode::kPosition);
  }
}

TEST_F(ProgramSwitchTest, FieldsBeginAnewAndStartupsRun) {
  Lone("n = 0; behavior b() { n += 1; self.jointSetDegreesNonBlocking(self.TURN, n); }");
  TakeRole();
  vms_->Tick(30);
  ASSERT_GT(Target(), 20);
  ReplaceRole("n = 5; behavior b() { n += 1; self.jointSetDegreesNonBlocking(self.TURN, n); }");
  vms_->Tick();
  EXPECT_NEAR(Target(), 6, 1e-9);
}

TEST_F(ProgramSwitchTest, ARoleThatTheNewProgramLacksIsLostAndItsJointsHold) {
  const std::string old = WithConvention(
      "TWO", "behavior b() { self.jointSetDegreesNonBlocking(self.TURN, 60); self.sleepds(100); }");
  for (const char* next :
       {"role Other extends Module { require 1 > 2; }", "role R extends Module { require 1 > 2; }",
        "role R extends Module { label l = self.joints($ANY, 9); }",
        "role R extends Module { startup s() { self.SLIDE.SET_POSITION(1); } }",
        "abstract role R extends Module { n; } role S extends R {"
        " n = 1; require 1 > 2; }"}) {
    Lone(old);
    TakeRole();
    vms_->Tick(3);
    const double target = Target();
    Replace(next);
    vms_->Tick();
    EXPECT_EQ(vms_->output(0).status.role, -1) << next;
    EXPECT_EQ(Sign(), 0) << next;
    EXPECT_EQ(Target(), target) << next;
  }
}

TEST_F(ProgramSwitchTest, ARoleOfAnotherNameIsTakenAtOnceForNothingHasMoved) {
  Lone("require 1 < 2;");
  TakeRole();
  Replace(
      "role Other extends Module { startup s() {"
      " self.jointSetDegreesNonBlocking(self.TURN, 10); } }");
  vms_->Tick();
  EXPECT_EQ(vms_->output(0).status.role, 0);
  EXPECT_NEAR(Target(), 10, 1e-9);
}

TEST_F(ProgramSwitchTest, AModuleThatHasNotSettledWaitsUnderTheNewProgramToo) {
  robot_ = test::ChainRobot(model_, 2);
  const std::string program = "role R extends Module { require sizeof(self.connected) == 1; }";
  vms_ = std::make_unique<VmRobot>(model_, robot_, test::ProgramFrom(program, model_));
  vms_->Tick(5);
  Replace(program + " role Unused extends Module { require 1 > 2; }");
  vms_->Tick(3);
  EXPECT_EQ(vms_->output(0).status.role, -1);
  vms_->Tick(20);
  EXPECT_EQ(vms_->output(0).status.role, 0);
}

TEST_F(ProgramSwitchTest, RolesOfNeighboursAreKnownByNameInTheTickOfTheSwitch) {
  robot_ = test::ChainRobot(model_, 2);
  vms_ = std::make_unique<VmRobot>(model_, robot_,
                                   test::ProgramFrom("role R extends Module { }", model_));
  vms_->Tick(40);
  // R is another number now; the mate's last message named it by the old one.
  Replace(
      "role Unused extends Module { require 1 > 2; }"
      "role R extends Module { startup s() { if (self.connected($ANY, $R) == 1) {"
      " self.jointSetDegreesNonBlocking(self.TURN, 30); } } }");
  vms_->Tick();
  for (int m = 0; m < 2; ++m) {
    EXPECT_EQ(vms_->output(m).status.role, 1);
    EXPECT_NEAR(vms_->output(m).joints[0].target / kDegree, 30, 1e-9) << m;
  }
}

TEST_F(ProgramSwitchTest, RolesThatRestOnNeighboursRolesAreKeptWhileAllGoOverTogether) {
  robot_ = test::ChainRobot(model_, 5);
  const std::string roles =
      "role Middle extends Module { require sizeof(self.connected) == 2; }"
      "role End extends Module { require sizeof(self.connected($ANY, $Middle)) == 1;"
      " require sizeof(self.connected) == 1; }";
  vms_ = std::make_unique<VmRobot>(model_, robot_, test::ProgramFrom(roles, model_));
  vms_->Tick(60);
  ASSERT_EQ(vms_->output(0).status.role, 1);
  Replace("role Unused extends Module { require 1 > 2; }" + roles);
  for (int i = 0; i < 60; ++i) {
    vms_->Tick();
    for (int m = 0; m < 5; ++m) {
      ASSERT_EQ(vms_->output(m).status.role, m == 0 || m == 4 ? 2 : 1) << "m" << m << " tick " << i;
    }
  }
}

TEST_F(ProgramSwitchTest, TheRootsClockIsKnownEverywhereWhateverTheLinksLose) {
  robot_ = test::ChainRobot(model_, 6);
  VmRobotOptions options;
  options.loss = 0.3;
  options.late = 0.2;
  options.grace_ticks = 25;
  vms_ = std::make_unique<VmRobot>(model_, robot_,
                                   test::ProgramFrom("role R extends Module { }", model_), options);
  int64_t root_tick = 0;
  vms_->Tick();
  EXPECT_FALSE(vms_->vm(5).RootTick(1, &root_tick)) << "its messages have yet to arrive";
  vms_->Tick(200);
  for (int m = 0; m < 6; ++m) {
    ASSERT_TRUE(vms_->vm(m).RootTick(vms_->tick() + 1, &root_tick));
    EXPECT_EQ(root_tick, vms_->tick() + 1) << "module " << m;
  }
  // A module that was late for a while, and heard of what was ahead of it, is not misled for long.
  vms_->state(5).pose.clock_ahead = 9;
  vms_->Tick(600);
  ASSERT_TRUE(vms_->vm(5).RootTick(vms_->tick() + 1, &root_tick));
  const int64_t behind = vms_->tick() + 1 - root_tick;
  EXPECT_GE(behind, 0);
  EXPECT_LE(behind, 2);
  // Cut off, it counts on.
  vms_->SetDocked(4, false);
  vms_->Tick(100);
  ASSERT_TRUE(vms_->vm(5).RootTick(vms_->tick() + 1, &root_tick));
  EXPECT_EQ(root_tick, vms_->tick() + 1 - behind);
}

/// The image of a program with another value of a parameter.
std::vector<uint8_t> WithParameter(const std::vector<uint8_t>& image, const char* name,
                                   const char* value) {
  VerifiedProgram program;
  EXPECT_EQ(Verifier::Verify(image.data(), static_cast<uint32_t>(image.size()), &program).message,
            nullptr);
  const Result<std::string> other = dynarole::WithParameter(program, name, value);
  EXPECT_TRUE(other) << other.error().message;
  return {other->begin(), other->end()};
}

TEST_F(ProgramSwitchTest, AnotherValueOfAParameterEndsNothing) {
  const std::string members =
      WithConvention("TWO",
                     "param step = 2 in [0, 90]; n = 1; behavior b() { n += 1;"
                     " self.jointSetDegreesNonBlocking(self.TURN, step * n);"
                     " self.sleepcs(20); n += 10; }");
  Lone(members);
  TakeRole();
  while (std::lround(Target()) != 2 * 2 * Sign()) vms_->Tick();
  const int sign = Sign();
  // The task sleeps on in the middle of its round, and counts on from the same field.
  vms_->ReplaceProgram(
      0, WithParameter(test::ProgramFrom("role R extends Module {\n" + members + "\n}\n", model_),
                       "step", "3"));
  const std::vector<int> targets = Targets(12);
  EXPECT_EQ(targets, (std::vector<int>{2 * 2 * sign, 3 * 13 * sign}));
  EXPECT_EQ(vms_->output(0).status.role, 0);
  EXPECT_EQ(Sign(), sign);
}

TEST_F(ProgramSwitchTest, WhatNeighboursSaidUnderTheValuesBeforeStillMeansTheSame) {
  // Each counts by itself, and turns by what the other has said a tick before.
  const std::vector<uint8_t> program = test::ProgramFrom(
      "param step = 1 in [0, 9];\nrole R extends Module {\n"
      " shared x = 0;\n"
      " behavior count() { x += step; self.sleepcs(2); }\n"
      " behavior read() {\n"
      "   if (self.connected($ANY, $R) == 1) {\n"
      "     self.jointSetDegreesNonBlocking(self.TURN, self.connected($ANY, $R).x); }\n"
      "   self.sleepcs(2); } }\n",
      model_);
  robot_ = test::ChainRobot(model_, 2);
  vms_ = std::make_unique<VmRobot>(model_, robot_, program, VmRobotOptions());
  vms_->Tick(40);
  ASSERT_EQ(vms_->output(0).status.role, 0);
  long last = std::lround(Target());
  for (int i = 0; i < 6; ++i) {
    if (i == 3) {
      for (int m = 0; m < 2; ++m) vms_->ReplaceProgram(m, WithParameter(program, "step", "5"));
    }
    vms_->Tick();
    EXPECT_EQ(vms_->output(0).status.num_faults, 0) << "tick " << i;
    // What it hears in the tick of the change was counted before it.
    EXPECT_EQ(std::lround(Target()) - last, i < 4 ? 1 : 5) << "tick " << i;
    last = std::lround(Target());
  }
}

}  // namespace
}  // namespace morphbus::vm
