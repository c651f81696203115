// What exports make of attributes that only some formats have: friction of links, and what makes
// real modules differ.
#include <gtest/gtest.h>

#include <algorithm>

#include "compiler/emit/back_ends.h"
#include "compiler/emit/webots.h"
#include "test/compiler/solver/known_modules.h"

namespace morphbus::emit {
namespace {

/// A pair of M-TRAN modules as the compiler knows them, of which one link grips on its own.
model::Model Gripping() {
  model::Model model = test::MtranModel(0.0325);
  model.robots = {test::Quadruped(model, 0.0325)};
  model.module_types[0].links[0].friction = 0.25;
  return model;
}

size_t CountOf(const std::string& text, const std::string& part) {
  size_t count = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST(ExportedAttributes, FrictionOfALinkIsThatOfItsShapesAndOfNoOther) {
  const model::Model model = Gripping();
  const RobotTree tree = TreeOf(model, model.robots[0]);
  const RobotTree open = OpenTreeOf(model, model.robots[0]);
  const size_t modules = model.robots[0].modules.size();
  EXPECT_EQ(CountOf(ToSdf(model, tree, {}, {}).text, "<mu>0.25</mu>"), modules);
  EXPECT_EQ(CountOf(ToMjcf(model, tree, "robot", {}).text, "friction=\"0.25 0.005 0.0001\""),
            modules);
  EXPECT_EQ(CountOf(ToUrdf(model, open, {}).text, "<mu1>0.25</mu1>"), modules);
  const Result<Exported> webots = ToWebots(model, model.robots[0], {});
  ASSERT_TRUE(webots) << webots.error().message;
  const std::string material =
      model.module_types[0].name + "." + model.module_types[0].links[0].name + ".surface";
  EXPECT_EQ(CountOf(webots->text, "contactMaterial \"" + material + "\""), modules);
  // Against the floor its own friction counts, and so it does against its like.
  EXPECT_EQ(CountOf(webots->text, "coulombFriction [ 0.25 ]"), 2u);
}

TEST(ExportedAttributes, WithoutAFrictionNothingIsSaidOfIt) {
  model::Model model = Gripping();
  model.module_types[0].links[0].friction.reset();
  const RobotTree tree = TreeOf(model, model.robots[0]);
  EXPECT_EQ(CountOf(ToSdf(model, tree, {}, {}).text, "friction"), 0u);
  EXPECT_EQ(CountOf(ToMjcf(model, tree, "robot", {}).text, "friction"), 0u);
  EXPECT_EQ(CountOf(ToUrdf(model, OpenTreeOf(model, model.robots[0]), {}).text, "mu1"), 0u);
  EXPECT_EQ(CountOf(ToWebots(model, model.robots[0], {})->text, "contact"), 0u);
}

TEST(ExportedAttributes, WhatAFormatDoesNotHoldIsSaid) {
  model::Model model = Gripping();
  model.module_types[0].joints[1].backlash = 0.01;
  model.module_types[0].joints[0].delay_s = 0.02;
  model.module_types[0].links[0].mass_spread = 0.1;
  const std::string type = model.module_types[0].name;
  const auto said = [&](const Exported& exported, const std::string& format) {
    for (const std::string& what :
         {" holds no backlash: left out of " + type + "." + model.module_types[0].joints[1].name,
          " holds no delay of commands: left out of " + type + "." +
              model.module_types[0].joints[0].name,
          " holds no spread of masses: left out of " + type + "." +
              model.module_types[0].links[0].name}) {
      EXPECT_EQ(std::ranges::count(exported.warnings, format + what), 1) << format << what;
    }
  };
  const RobotTree tree = TreeOf(model, model.robots[0]);
  said(ToSdf(model, tree, {}, {}), "SDF");
  said(ToMjcf(model, tree, "robot", {}), "MJCF");
  said(ToUrdf(model, OpenTreeOf(model, model.robots[0]), {}), "URDF");
  said(*ToWebots(model, model.robots[0], {}), "Webots");
}

}  // namespace
}  // namespace morphbus::emit
