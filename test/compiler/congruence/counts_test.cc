// How many mappings there are: of the robots in models/, of robots with many parts alike, and what
// is said where counting ends.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <numeric>

#include "compiler/base/check.h"
#include "compiler/congruence/congruence.h"
#include "compiler/congruence/mappings.h"
#include "compiler/m3l/compile.h"
#include "compiler/model/loop_constraints.h"
#include "test/compiler/congruence/assemblies.h"
#include "test/compiler/congruence/texts.h"
#include "test/support/large_robots.h"
#include "test/support/source_dir.h"
#include "test/support/toy_model.h"

namespace morphbus::congruence {
namespace {

using test::Named;

model::Model Shipped(const std::string& file) {
  const m3l::CompileOutput output = m3l::CompileFiles({test::SourcePath("models/") + file});
  MORPHBUS_CHECK(output.model.has_value());
  return *output.model;
}

TEST(Counts, OfTheRobotsInModelsAreThoseKnown) {
  const struct {
    const char* file;
    const char* robot;
    int64_t count;
  } kKnown[] = {{"mtran.m3l", "quadruped", 4},      {"mtran.m3l", "equivalent_quadruped", 4},
                {"mtran_robots.m3l", "snake", 4},   {"mtran_robots.m3l", "caterpillar", 64},
                {"mtran_robots.m3l", "crawler", 4}, {"atron.m3l", "car", 2},
                {"atron.m3l", "car7", 8},           {"molecube.m3l", "snake", 2},
                {"molecube.m3l", "arm", 1},         {"ckbot.m3l", "snake", 4},
                {"ckbot.m3l", "loop", 40},          {"mixed.m3l", "inchworm", 4}};
  for (const auto& known : kKnown) {
    SCOPED_TRACE(fmt::format("{} {}", known.file, known.robot));
    const model::Model model = Shipped(known.file);
    const model::Robot& robot = Named(model, known.robot);
    const Congruence c = Compare(model, robot, model, robot);
    EXPECT_EQ(c.count, known.count);
    EXPECT_TRUE(c.count_complete);
    EXPECT_EQ(c.mappings.size(), static_cast<size_t>(known.count));
    EXPECT_TRUE(c.mappings[0].keeps_frame);
  }
}

/// The number of mappings, by going through them one by one.
int64_t Listed(const model::Model& model, const model::Robot& a, const model::Robot& b) {
  const ScrewGraph assembly_a = BuildScrewGraph(model, a);
  const ScrewGraph assembly_b = BuildScrewGraph(model, b);
  Steps steps{2'000'000};
  int64_t count = 0;
  ForEachMapping(assembly_a, assembly_b, RefinedClasses(assembly_a, assembly_b), steps,
                 [&](const Mapping&) { return ++count < 100'000; });
  MORPHBUS_CHECK(!steps.gave_up());
  return count;
}

void ExpectCountedAsListed(const model::Model& model, const model::Robot& a,
                           const model::Robot& b) {
  const Congruence c = Compare(model, a, model, b);
  const int64_t listed = Listed(model, a, b);
  EXPECT_EQ(c.count, std::min(listed, kMaxCounted));
  EXPECT_EQ(c.count_complete, listed <= kMaxCounted);
}

TEST(Counts, AreAsManyAsCanBeListedForEveryKindOfJoint) {
  const model::Model model = test::ToyModel();
  for (uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    const model::Robot robot = test::RandomRobot(model, 1 + static_cast<int>(seed % 6), 0, seed);
    const model::Robot other = test::Relabelled(model, robot, seed);
    ExpectCountedAsListed(model, robot, robot);
    ExpectCountedAsListed(model, robot, other);
  }
}

TEST(Counts, AreAsManyAsCanBeListed) {
  for (const char* file : {"mtran.m3l", "atron.m3l", "molecube.m3l", "ckbot.m3l"}) {
    const model::Model model = Shipped(file);
    for (uint64_t seed = 1; seed <= 25; ++seed) {
      SCOPED_TRACE(fmt::format("{} {}", file, seed));
      const model::Robot robot = test::RandomTree(model, 2 + static_cast<int>(seed % 7), seed);
      const model::Robot other = test::Relabelled(model, robot, seed);
      ExpectCountedAsListed(model, robot, robot);
      ExpectCountedAsListed(model, robot, other);
    }
  }
}

/// A row of segments, each with two wheels alike on one axle; `last` is the connector of the last
/// but one that the last segment sits on.
model::Model Wheeled(int segments) {
  std::string text = "module SEG: unit=0.1\n" + test::Socket("back", {-1, 0, 0}) +
                     test::Socket("front", {1, 0, 0}) + test::Socket("side", {0, 1, 0}) +
                     "link body: grouping=(front, side), mass=1\n"
                     "link tail: grouping=(back), mass=1\n"
                     "axis ya: origin=(-.5, 0, 0), direction=(0, 0, 1)\n"
                     "axis yb: origin=(-.5, 0, 0), direction=(0, 0, -1)\n"
                     "joint yaw: type=revolute, value=[-1, 1.5], pair=((tail, ya), (body, yb))\n"
                     "axis pa: origin=(0, 0, -.3), direction=(0, 1, 0)\n"
                     "axis pb: origin=(0, 0, -.3), direction=(0, -1, 0)\n";
  for (const int i : {0, 1}) {
    text += fmt::format(
        "link w{0}: mass=0.1\njoint spin{0}: type=continuous, pair=((w{0}, pa), (body, pb))\n", i);
  }
  text += test::Joining("SEG", "SEG");
  for (const char* last : {"front", "side"}) {
    std::string modules;
    std::string connections;
    for (int i = 0; i < segments; ++i) {
      modules += fmt::format("{}SEG m{}", i == 0 ? "" : ", ", i);
      if (i == 0) continue;
      connections += fmt::format("{}(m{}.{}, m{}.back)", i == 1 ? "" : ", ", i - 1,
                                 i + 1 < segments ? "front" : last, i);
    }
    text += fmt::format("robot {}: modules=({}), connections=({})\n", last, modules, connections);
  }
  return test::Compiled(text);
}

TEST(Counts, OfIndependentPartsMultiply) {
  const model::Model small = Wheeled(4);
  const Congruence few = Compare(small, Named(small, "front"), small, Named(small, "front"));
  EXPECT_EQ(few.count, 16);
  EXPECT_EQ(few.mappings.size(), 16u);
  const model::Model nine = Wheeled(9);
  const Congruence many = Compare(nine, Named(nine, "front"), nine, Named(nine, "front"));
  EXPECT_EQ(many.count, 512);
  EXPECT_TRUE(many.count_complete);
  EXPECT_EQ(many.mappings.size(), 512u);
}

TEST(Counts, EndAboveAThousandAndTheVerdictDoesNot) {
  const model::Model ten = Wheeled(10);
  const Congruence just_over = Compare(ten, Named(ten, "front"), ten, Named(ten, "front"));
  EXPECT_EQ(just_over.count, kMaxCounted);
  EXPECT_FALSE(just_over.count_complete) << "1,024 are more";
  const model::Model model = Wheeled(60);
  const model::Robot& a = Named(model, "front");
  const Congruence c = Compare(model, a, model, a);
  EXPECT_TRUE(c.decided);
  EXPECT_EQ(c.count, kMaxCounted);
  EXPECT_FALSE(c.count_complete);
  ASSERT_FALSE(c.mappings.empty());
  EXPECT_TRUE(c.mappings[0].keeps_frame);
  test::ExpectSameMotion(model, a, model, a, c, c.mappings[0], 1);
  const Congruence other = Compare(model, a, model, Named(model, "side"));
  EXPECT_TRUE(other.decided) << "wheels that are alike keep nothing from being decided";
  EXPECT_FALSE(other.congruent());
}

TEST(Counts, OfTooManyToListComeWithTheMappingThatIsFirstByNames) {
  // Eight wheels, modules of their own, on one axle: declared in one order or in the other.
  std::string text = "module HUB: unit=1\n";
  std::string grouping;
  for (int i = 1; i <= 8; ++i) {
    text += test::Socket(fmt::format("c{}", i), {1, 0, 0});
    grouping += fmt::format("{}c{}", i == 1 ? "" : ", ", i);
  }
  text += "link hub: grouping=(" + grouping + "), mass=1\nmodule WHEEL: unit=1\n" +
          test::Socket("c", {0, 0, 0}) +
          "link mount: grouping=(c), mass=1\nlink tyre: mass=1\n"
          "axis a: origin=(0, 2, 0), direction=(0, 0, 1)\n"
          "axis b: origin=(0, 2, 0), direction=(0, 0, -1)\n"
          "joint j: type=revolute, value=[-1, 1.5], pair=((tyre, a), (mount, b))\n" +
          test::Joining("HUB", "WHEEL");
  for (const bool upwards : {true, false}) {
    std::string modules;
    std::string connections;
    for (int i = 1; i <= 8; ++i) {
      modules += fmt::format(", WHEEL w{}", upwards ? i : 9 - i);
      connections += fmt::format("{}(h.c{}, w{}.c)", i == 1 ? "" : ", ", i, i);
    }
    text += fmt::format("robot {}: modules=(HUB h{}), connections=({})\n", upwards ? "up" : "down",
                        modules, connections);
  }
  const model::Model model = test::Compiled(text);
  const model::Robot& up = Named(model, "up");
  const model::Robot& down = Named(model, "down");
  const Congruence c = Compare(model, up, model, down);
  EXPECT_EQ(c.count, kMaxCounted) << "of 8! mappings";
  EXPECT_FALSE(c.count_complete);
  ASSERT_FALSE(c.mappings.empty());
  EXPECT_TRUE(c.mappings[0].keeps_frame);
  for (size_t m = 0; m < up.modules.size(); ++m) {
    const auto to = static_cast<size_t>(c.mappings[0].module_to[m]);
    EXPECT_EQ(down.modules[to].name, up.modules[m].name);
  }
}

TEST(Counts, OfRingsAreThoseOfTheirSymmetries) {
  for (const int modules : {8, 100, 600}) {
    SCOPED_TRACE(modules);
    const model::Model model = *m3l::CompileText("large.m3l", test::LargeRingText(modules)).model;
    const model::Robot& ring = *model.FindRobot("large");
    const Congruence c = Compare(model, ring, model, ring);
    EXPECT_EQ(c.count, std::min<int64_t>(8 * modules, kMaxCounted));
    EXPECT_EQ(c.count_complete, 8 * modules <= kMaxCounted);
    EXPECT_EQ(c.locked_computed, 2 * modules <= model::kMaxLoopJoints);
    // Another frame, other names: as many, and none that keeps the frame.
    const model::Robot other = test::Relabelled(model, ring, 3);
    const Congruence turned = Compare(model, ring, model, other);
    EXPECT_EQ(turned.count, c.count);
    ASSERT_FALSE(turned.mappings.empty());
    EXPECT_FALSE(turned.mappings[0].keeps_frame);
    // Every module can go to every other, so the first goes to the first name.
    EXPECT_EQ(other.modules[turned.mappings[0].module_to[0]].name, "n0");
  }
}

TEST(Counts, ThatWereGivenUpAreMarkedAndBelowTheTrueNumber) {
  const model::Model model = *m3l::CompileText("large.m3l", test::LargeRingText(40)).model;
  const ScrewGraph ring = BuildScrewGraph(model, *model.FindRobot("large"));
  Steps enough{1'000'000};
  const MappingCount all = CountSymmetries(ring, enough);
  EXPECT_EQ(all.count, 320);
  EXPECT_TRUE(all.exact);
  for (const int64_t few : {10, 100, 300}) {
    Steps steps{few};
    const MappingCount some = CountSymmetries(ring, steps);
    EXPECT_FALSE(some.exact);
    EXPECT_LT(some.count, all.count);
  }
}

TEST(Counts, AreZeroWhereTheSearchWasGivenUpBeforeAMappingWasFound) {
  const model::Model model = *m3l::CompileText("large.m3l", test::LargeRingText(40)).model;
  const model::Robot& ring = *model.FindRobot("large");
  const model::Robot other = test::Relabelled(model, ring, 1);
  const Congruence undecided = Compare(model, ring, model, other, 20);
  EXPECT_FALSE(undecided.decided);
  EXPECT_FALSE(undecided.congruent());
  EXPECT_TRUE(undecided.reason.empty()) << undecided.reason;
  // Enough to find one, not to count all.
  const Congruence some = Compare(model, ring, model, ring, 300);
  EXPECT_TRUE(some.decided);
  EXPECT_TRUE(some.congruent());
  EXPECT_FALSE(some.count_complete);
  EXPECT_LT(some.count, 320);
  ASSERT_FALSE(some.mappings.empty());
  EXPECT_TRUE(some.mappings[0].keeps_frame);
}

TEST(Masses, AreComparedUnderEveryMappingThatIsListed) {
  // One heavy block: of the four ways to itself only that which leaves it where it is keeps masses.
  model::Model model = test::MtranFile();
  const model::Robot robot = *model.FindRobot("quadruped");
  model.module_types.push_back(model.module_types[0]);
  model.module_types[1].links[0].mass_kg *= 2.0;
  model::Robot heavy = robot;
  heavy.modules[0].type = 1;
  const Congruence self = Compare(model, heavy, model, heavy);
  EXPECT_EQ(self.count, 4);
  EXPECT_TRUE(self.masses.masses_equal);
  EXPECT_EQ(self.masses_alike, 1u);
  EXPECT_EQ(self.hulls_alike, 4u);
  // On another leg: not under the mapping that keeps the frame, but under another.
  model::Robot other = robot;
  other.modules[5].type = 1;
  const Congruence c = Compare(model, heavy, model, other);
  EXPECT_FALSE(c.masses.masses_equal);
  EXPECT_EQ(c.masses_alike, 1u);
}

TEST(InFrame, IsAskedByItself) {
  const model::Model& model = test::MtranFile();
  const model::Robot& a = *model.FindRobot("quadruped");
  const model::Robot& b = *model.FindRobot("equivalent_quadruped");
  const std::optional<MassComparison> masses = CompareInFrame(model, a, model, b);
  ASSERT_TRUE(masses.has_value());
  EXPECT_TRUE(masses->masses_equal);
  const model::Robot moved = test::Relabelled(model, a, 1);
  EXPECT_TRUE(Compare(model, a, model, moved).congruent());
  EXPECT_FALSE(CompareInFrame(model, a, model, moved).has_value());
}

}  // namespace
}  // namespace morphbus::congruence
