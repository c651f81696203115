#include "tools/control/command_check.h"

#include <gtest/gtest.h>

#include <set>

#include "tools/base/messages.h"

namespace morphbus::tools {
namespace {

/// Two modules of one type, with a link and two connectors each.
model::Model TwoModules() {
  model::ModuleType type;
  type.name = "Block";
  type.links.push_back({"body", {}});
  for (const char* name : {"c1", "c2"}) {
    model::Connector& connector = type.connectors.emplace_back();
    connector.name = name;
  }
  model::Robot robot;
  robot.name = "pair";
  robot.modules = {{"m1", 0, {}}, {"m2", 0, {}}};
  model::Model model;
  model.module_types.push_back(std::move(type));
  model.robots.push_back(std::move(robot));
  return model;
}

class CommandCheckTest : public ::testing::Test {
 protected:
  Refusal Check(const char* text) { return check_.Check(*bridge::ParseControl(text)); }
  Refusal CheckProgram(const char* text) {
    return check_.CheckProgram(*bridge::ParseControl(text));
  }

  const model::Model model_ = TwoModules();
  RunImages images_ = {0x1, {}, ""};
  std::set<int> lost_;
  std::vector<uint64_t> programs_ = {0x1, 0x1};
  CommandCheck check_ = {model_,
                         model_.robots[0],
                         "m2",
                         &images_,
                         {[this](int module) { return lost_.contains(module); },
                          [this](int module) { return programs_[module]; }}};
};

TEST_F(CommandCheckTest, WhatIsNamedMustBeThere) {
  for (const char* text : {"push m1 EAST 1", "push m1.body EAST 1", "disconnect m2.c2",
                           "connect m1.c1 m2.c2", "kill m1", "lose m2", "inspect", "pause"}) {
    EXPECT_FALSE(Check(text)) << text;
  }
  EXPECT_EQ(Check("kill m3").status, kUnusable);
  EXPECT_EQ(Check("kill m3").reason, "the robot has no module 'm3' (did you mean 'm1'?)");
  EXPECT_EQ(Check("invoke A.b --to m3").status, kUnusable);
  EXPECT_EQ(Check("connect m1.c1 m3.c1").status, kUnusable);
  EXPECT_EQ(Check("connect m1.c1 m2.c3").reason, "m2 has no 'c3' (did you mean 'c1'?)");
  // Links are pushed, connectors are not.
  EXPECT_EQ(Check("push m1.c1 EAST 1").reason, "m1 has no 'c1'");
  EXPECT_EQ(Check("disconnect m1.body").reason, "m1 has no 'body'");
}

TEST_F(CommandCheckTest, NothingIsAskedOfAModuleThatIsLost) {
  lost_ = {0};
  for (const char* text : {"kill m1", "restart m1", "lose m1", "inspect m1", "invoke A.b --to m1",
                           "deploy x.dyn 2 --to m1"}) {
    EXPECT_EQ(Check(text).status, kNo) << text;
    EXPECT_EQ(Check(text).reason, "m1 is lost: the run goes on without it") << text;
  }
  EXPECT_FALSE(Check("inspect"));
  EXPECT_FALSE(Check("push m1 EAST 1")) << "its body is still there";
}

TEST_F(CommandCheckTest, AProgramMustHaveBeenHandedOver) {
  const Refusal refusal = Check("deploy x.dyn 2");
  EXPECT_EQ(refusal.status, kUnusable);
  EXPECT_EQ(refusal.reason, "x.dyn was not handed over as an image that can be verified");
}

TEST_F(CommandCheckTest, AProgramThatRunsThereIsNotDeployed) {
  programs_ = {0x2, 0x1};
  EXPECT_EQ(CheckProgram("deploy x.dyn 2 --to m1").reason, "m1 runs this program already");
  EXPECT_EQ(CheckProgram("deploy x.dyn 2 --to m1").status, kNo);
  EXPECT_FALSE(CheckProgram("deploy x.dyn 2")) << "m2 is the root";
}

TEST_F(CommandCheckTest, ACallNeedsAProgramThatIsKnown) {
  EXPECT_EQ(CheckProgram("invoke A.b").reason, "nobody knows the program that runs there");
  EXPECT_EQ(CheckProgram("invoke A.b").status, kFailed);
}

TEST_F(CommandCheckTest, WhatIsAddressedToNobodyGoesToTheRoot) {
  EXPECT_EQ(check_.Addressee(*bridge::ParseControl("invoke A.b")), 1);
  EXPECT_EQ(check_.Addressee(*bridge::ParseControl("invoke A.b --to m1")), 0);
  EXPECT_EQ(check_.ModuleOf(*bridge::ParseControl("kill m2")), 1);
}

}  // namespace
}  // namespace morphbus::tools
