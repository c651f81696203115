#include "compiler/congruence/variants.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "compiler/base/read_file.h"
#include "compiler/congruence/congruence.h"
#include "compiler/congruence/placements.h"
#include "compiler/emit/back_ends.h"
#include "compiler/m3l/compile.h"
#include "test/compiler/congruence/assemblies.h"
#include "test/compiler/congruence/texts.h"
#include "test/compiler/solver/known_modules.h"
#include "test/support/source_dir.h"

namespace morphbus::congruence {
namespace {

const std::vector<JointRef> kLocked = {{4, 0}, {4, 1}};

std::string KeyOf(const model::Robot& robot) {
  std::string key;
  for (const model::Docking& d : robot.dockings) key += std::to_string(d.option) + " ";
  return key;
}

/// Another route to the variants of two modules: of all options of the connection, those that give
/// a robot congruent to `robot` with each module as itself.
size_t CongruentOptions(const model::Model& model, model::Robot robot) {
  model::Robot other = robot;
  size_t count = 0;
  for (const bool swapped : {false, true}) {
    const auto& options = model.connection_types[0].options;
    for (size_t o = 0; o < options.size(); ++o) {
      if (swapped && model::MirrorOption(model, {0, options[o].connector_a, 1,
                                                 options[o].connector_b, 0, static_cast<int>(o)})) {
        continue;  // the same joining, seen from the other side
      }
      other.dockings[0] = {
          swapped ? 1 : 0,    options[o].connector_a, swapped ? 0 : 1, options[o].connector_b, 0,
          static_cast<int>(o)};
      const Congruence c = Compare(model, robot, model, other);
      count += std::any_of(c.mappings.begin(), c.mappings.end(),
                           [](const Mapping& mapping) { return mapping.module_to[0] == 0; })
                   ? 1
                   : 0;
    }
  }
  return count;
}

TEST(Variants, OfTheQuadrupedAreDifferentAssembliesThatMoveAlike) {
  const model::Model& model = test::MtranFile();
  const model::Robot& robot = *model.FindRobot("quadruped");
  VariantOptions options;
  options.max = 20;
  options.seed = 7;
  const std::vector<Variant> variants = Variants(model, robot, options);
  ASSERT_EQ(variants.size(), 20u);
  std::set<std::string> keys = {KeyOf(robot)};
  bool blocks_exchanged = false;
  for (const auto& [variant, masses] : variants) {
    EXPECT_TRUE(keys.insert(KeyOf(variant)).second) << "twice the same";
    blocks_exchanged = blocks_exchanged || variant.root_link != robot.root_link;
    const Congruence c = Compare(model, robot, model, variant);
    EXPECT_EQ(c.count, 4) << c.reason;
    ASSERT_TRUE(c.congruent());
    EXPECT_TRUE(c.mappings[0].keeps_frame);
    EXPECT_TRUE(c.masses.masses_equal);
    test::ExpectSameMotion(model, robot, model, variant, c, c.mappings[0], 1, kLocked);
  }
  EXPECT_TRUE(blocks_exchanged);
  EXPECT_EQ(variants.front().robot.name, "quadruped_variant_1");
  const std::vector<Variant> again = Variants(model, robot, options);
  ASSERT_EQ(again.size(), variants.size());
  for (size_t i = 0; i < again.size(); ++i)
    EXPECT_EQ(KeyOf(again[i].robot), KeyOf(variants[i].robot));
}

TEST(CongruenceHash, IsSharedByThoseShippedRobotsThatAreCongruent) {
  constexpr size_t kMostModules = 16;
  std::vector<model::Model> models;
  for (const char* name :
       {"atron", "ckbot", "mixed", "molecube", "mtran", "mtran_robots", "smores"}) {
    m3l::CompileOutput output = m3l::CompileFiles({test::SourcePath("models/") + name + ".m3l"});
    ASSERT_TRUE(output.model) << name;
    models.push_back(std::move(*output.model));
  }
  std::vector<std::pair<const model::Model*, const model::Robot*>> robots;
  for (const model::Model& model : models) {
    for (const model::Robot& robot : model.robots) {
      if (robot.modules.size() <= kMostModules) robots.emplace_back(&model, &robot);
    }
  }
  ASSERT_GT(robots.size(), 12u);
  int shared = 0;
  for (size_t a = 0; a < robots.size(); ++a) {
    for (size_t b = 0; b < a; ++b) {
      const auto& [model_a, robot_a] = robots[a];
      const auto& [model_b, robot_b] = robots[b];
      const bool same = CongruenceHash(*model_a, *robot_a) == CongruenceHash(*model_b, *robot_b);
      EXPECT_EQ(same, Compare(*model_a, *robot_a, *model_b, *robot_b).congruent())
          << robot_a->name << " and " << robot_b->name;
      shared += same ? 1 : 0;
    }
  }
  EXPECT_GE(shared, 2);
}

TEST(CongruenceHash, TellsAllWaysOfJoiningTwoMolecubesApart) {
  // Their axes are skew, so that some of these robots are mirror images of each other.
  const m3l::CompileOutput output = m3l::CompileFiles({test::SourcePath("models/molecube.m3l")});
  ASSERT_TRUE(output.model);
  const model::Model& model = *output.model;
  const auto& ways = model.connection_types[0].options;
  std::vector<model::Robot> robots;
  for (size_t way = 0; way < ways.size(); ++way) {
    model::Robot robot = model.robots[0];
    robot.modules.resize(2);
    robot.dockings = {
        {0, ways[way].connector_a, 1, ways[way].connector_b, 0, static_cast<int>(way)}};
    robots.push_back(std::move(robot));
  }
  int alike = 0;
  int others = 0;
  for (size_t way = 0; way < robots.size(); ++way) {
    for (const size_t first : {0, 1, 2}) {
      const bool same = CongruenceHash(model, robots[way]) == CongruenceHash(model, robots[first]);
      EXPECT_EQ(same, Compare(model, robots[way], model, robots[first]).congruent())
          << way << " and " << first;
      (same ? alike : others) += 1;
    }
  }
  EXPECT_GT(alike, 10);
  EXPECT_GT(others, 10);
}

TEST(CongruenceHash, IsThatOfTheVariantsAndOfNoOtherRobot) {
  const model::Model& model = test::MtranFile();
  const model::Robot& robot = *model.FindRobot("quadruped");
  const uint64_t hash = CongruenceHash(model, robot);
  EXPECT_EQ(CongruenceHash(model, *model.FindRobot("equivalent_quadruped")), hash);
  VariantOptions options;
  options.max = 20;
  options.seed = 3;
  for (const Variant& variant : Variants(model, robot, options)) {
    EXPECT_EQ(CongruenceHash(model, variant.robot), hash);
  }
  // The last module turned on its neighbour: congruent or not, the hash says the same.
  const auto& ways = model.connection_types[0].options;
  const model::Docking& last = robot.dockings.back();
  for (size_t way = 0; way < ways.size(); ++way) {
    if (ways[way].connector_a != last.connector_a || ways[way].connector_b != last.connector_b) {
      continue;
    }
    model::Robot turned = robot;
    turned.dockings.back().option = static_cast<int>(way);
    const bool congruent = Compare(model, robot, model, turned).congruent();
    EXPECT_EQ(CongruenceHash(model, turned) == hash, congruent) << way;
  }
  // A module that is larger, one less, and a range that is narrower, are other robots.
  std::string text = *ReadWholeFile(test::SourcePath("models/mtran.m3l"), 1 << 20);
  const std::string unit = "unit=0.0325";
  text.replace(text.find(unit), unit.size(), "unit=0.0326");
  const m3l::CompileOutput larger = m3l::CompileText("larger.m3l", text);
  ASSERT_TRUE(larger.model);
  EXPECT_NE(CongruenceHash(*larger.model, *larger.model->FindRobot("quadruped")), hash);
  model::Robot shorter = robot;
  shorter.modules.pop_back();
  std::erase_if(shorter.dockings, [](const model::Docking& docking) {
    return docking.module_a == 8 || docking.module_b == 8;
  });
  EXPECT_NE(CongruenceHash(model, shorter), hash);
  model::Model narrow = model;
  narrow.module_types[0].joints[0].upper -= 0.1;
  EXPECT_NE(CongruenceHash(narrow, narrow.robots[0]), CongruenceHash(model, model.robots[0]));
}

TEST(Variants, SayWhereTheirMassesAreNotThoseOfTheRobot) {
  // With one block heavier than the other, a module that stands the other way round weighs
  // otherwise.
  model::Model model = test::MtranFile();
  model.module_types[0].links[0].mass_kg *= 2.0;
  const model::Robot& robot = *model.FindRobot("quadruped");
  VariantOptions options;
  options.max = 40;
  options.seed = 1;
  const std::vector<Variant> variants = Variants(model, robot, options);
  int alike = 0;
  for (const auto& [variant, masses] : variants) {
    const Congruence c = Compare(model, robot, model, variant);
    ASSERT_TRUE(c.congruent());
    EXPECT_EQ(masses.masses_equal, c.masses.masses_equal);
    EXPECT_EQ(masses.mass_difference.empty(), masses.masses_equal);
    alike += masses.masses_equal ? 1 : 0;
  }
  EXPECT_LT(alike, 40);
}

TEST(Variants, PassOverNamesThatRobotsHave) {
  model::Model model = test::MtranFile();
  model::Robot taken = *model.FindRobot("quadruped");
  const model::Robot robot = taken;
  taken.name = "quadruped_variant_2";
  model.robots.push_back(taken);
  VariantOptions options;
  options.max = 3;
  std::vector<std::string> names;
  for (const auto& [variant, masses] : Variants(model, robot, options)) {
    names.push_back(variant.name);
  }
  const std::vector<std::string> expected = {"quadruped_variant_1", "quadruped_variant_3",
                                             "quadruped_variant_4"};
  EXPECT_EQ(names, expected);
}

TEST(Placements, CountOnceWhatDocksAlike) {
  // A hub with a connector and two wheels on its axle: exchanged and turned wheels dock alike.
  const model::Model model = test::Compiled(
      "module SEG: unit=0.1\n" + test::Socket("front", {1, 0, 0}) +
      "link body: grouping=(front), mass=1\nlink w0: mass=0.1\nlink w1: mass=0.1\n"
      "axis pa: origin=(0, 0, 0), direction=(0, 1, 0)\n"
      "axis pb: origin=(0, 0, 0), direction=(0, -1, 0)\n"
      "joint s0: type=continuous, pair=((w0, pa), (body, pb))\n"
      "joint s1: type=continuous, pair=((w1, pa), (body, pb))\nrobot r: modules=(SEG m)\n");
  const model::Robot& robot = test::Named(model, "r");
  EXPECT_EQ(Compare(model, robot, model, robot).count, 4);
  const std::vector<Placement> placements = PlacementsOf(model, 0);
  ASSERT_FALSE(placements.empty());
  // The first one leaves everything where it is.
  for (size_t b = 0; b < placements[0].body_to.size(); ++b) {
    EXPECT_EQ(placements[0].body_to[b], static_cast<int>(b));
    EXPECT_TRUE(placements[0].C[b].isIdentity(1e-6));
  }
  for (size_t j = 0; j < placements[0].joints.size(); ++j) {
    EXPECT_EQ(placements[0].joints[j].to, static_cast<int>(j));
  }
  for (size_t i = 1; i < placements.size(); ++i) {
    EXPECT_GT((placements[i].C[0] - placements[0].C[0]).norm(), 1e-3);
  }
  EXPECT_EQ(placements.size(), 3u) << "as it is, and over in two ways: as it comes and onto itself";
}

TEST(Variants, AsTextCompileToWhatTheyAre) {
  const model::Model& model = test::MtranFile();
  model::Robot robot = *model.FindRobot("quadruped");
  robot.modules[0].start = {0.25, -0.5};
  VariantOptions options;
  options.seed = 3;
  const std::vector<Variant> variants = Variants(model, robot, options);
  std::string text = "import \"" + test::SourcePath("models/mtran.m3l") + "\"\n";
  for (const auto& [variant, masses] : variants) text += emit::RobotM3l(model, variant);
  const m3l::CompileOutput output = m3l::CompileText("variants.m3l", text);
  ASSERT_TRUE(output.model.has_value())
      << source::Render(output.diagnostics, output.sources, false);
  EXPECT_EQ(output.diagnostics.error_count(), 0);
  for (const auto& [variant, masses] : variants) {
    const model::Robot* compiled = output.model->FindRobot(variant.name);
    ASSERT_NE(compiled, nullptr);
    EXPECT_EQ(KeyOf(*compiled), KeyOf(variant));
    EXPECT_EQ(compiled->root_link, variant.root_link);
    EXPECT_LT((compiled->X_LR.matrix() - variant.X_LR.matrix()).norm(), 1e-12);
    for (size_t m = 0; m < variant.modules.size(); ++m) {
      EXPECT_EQ(compiled->modules[m].start, variant.modules[m].start);
    }
    EXPECT_TRUE(Compare(model, robot, *output.model, *compiled).congruent());
  }
}

TEST(Variants, EnumeratedWithoutASeedAreAllThereAre) {
  // Two M-TRANs in a row: each may be turned about the row, both may have their blocks exchanged.
  const model::Model& model = test::MtranFile();
  const model::Robot robot = test::Assemble(model, "pair", 2, {{"m1", "c2", "m2", "c5", {}}}, 0, 0,
                                            model::Pose::Identity());
  VariantOptions options;
  options.max = 1000;
  const std::vector<Variant> variants = Variants(model, robot, options);
  // (c2,c5) or (c5,c2), with the modules' faces the same way up or not: four, one is the pair.
  EXPECT_EQ(variants.size(), 3u);
  EXPECT_EQ(variants.size() + 1, CongruentOptions(model, robot));
  options.seed = 1;
  EXPECT_EQ(Variants(model, robot, options).size(), 3u);
}

TEST(Variants, GiveUpAConnectorThatAnotherDockingNeeds) {
  // Two connectors of m1 lie in one place. Its docking with m2 can be made with either, the other
  // one, a quarter turn further, with the first alone: m2 has to leave it, whichever way m2 stands.
  model::Model model = test::MtranFile();
  std::vector<model::Connector>& connectors = model.module_types[0].connectors;
  constexpr int kC2 = 1, kC5 = 4;
  const int twin = static_cast<int>(connectors.size());
  connectors.push_back(connectors[kC2]);
  connectors.back().name = "twin";
  std::vector<model::ConnectionOption>& options = model.connection_types[0].options;
  int straight = -1, quarter = -1;
  for (size_t o = 0, count = options.size(); o < count; ++o) {
    model::ConnectionOption option = options[o];
    const bool from_a = option.connector_a == kC2 && option.connector_b == kC5;
    if (!from_a && (option.connector_a != kC5 || option.connector_b != kC2)) continue;
    // The twin docks straight, or upside down.
    const double cosine = option.X_AB.linear()(1, 1);
    if (from_a && std::abs(cosine) < 0.5) quarter = static_cast<int>(o);
    if (std::abs(cosine) < 0.5) continue;
    (from_a ? option.connector_a : option.connector_b) = twin;
    option.number = static_cast<int>(options.size()) + 1;
    if (from_a && cosine > 0.5) straight = static_cast<int>(options.size());
    options.push_back(option);
  }
  model::Robot robot;
  robot.name = "three";
  robot.modules = {{"m1", 0, {0, 0}}, {"m2", 0, {0, 0}}, {"m3", 0, {0, 0}}};
  robot.dockings = {{0, twin, 1, kC5, 0, straight}, {0, kC2, 2, kC5, 0, quarter}};
  const std::vector<Variant> variants = Variants(model, robot, {.max = 1000, .seed = {}});
  // Of those in which m1 and m3 stay as they are, the one with m2 upside down.
  const auto turned = std::count_if(variants.begin(), variants.end(), [&](const Variant& variant) {
    const std::vector<model::Docking>& dockings = variant.robot.dockings;
    return dockings[1].option == quarter && dockings[0].connector_a == twin &&
           dockings[0].connector_b == kC5 && dockings[0].option != straight;
  });
  EXPECT_EQ(turned, 1);
}

/// ATRONs, their hinges without limits.
model::Model AtronModel() {
  model::Model model;
  model.module_types = {test::Atron(false)};
  model::Joint& joint = model.module_types[0].joints[0];
  joint.type = model::JointType::kContinuous;
  joint.lower = -INFINITY;
  joint.upper = INFINITY;
  source::Diagnostics diagnostics;
  model.connection_types = {solver::SolveConnection(
      test::SelfConnection(test::And({test::AllPointsCoincide(3), test::OppositeGenders(false)})),
      model.module_types, &diagnostics)};
  EXPECT_FALSE(diagnostics.had_errors());
  return model;
}

TEST(Variants, OfTwoAtronsAreAllWaysToJoinThem) {
  const model::Model model = AtronModel();
  const model::ConnectionOption& first = model.connection_types[0].options[0];
  model::Robot robot;
  robot.name = "two";
  robot.modules = {{"m1", 0, {0.1}}, {"m2", 0, {-0.4}}};
  robot.dockings = {{0, first.connector_a, 1, first.connector_b, 0, 0}};
  VariantOptions options;
  options.max = 1000;
  const std::vector<Variant> variants = Variants(model, robot, options);
  EXPECT_EQ(variants.size(), 31u);
  EXPECT_EQ(CongruentOptions(model, robot), 32u);
  for (const auto& [variant, masses] : variants) {
    const Congruence c = Compare(model, robot, model, variant);
    ASSERT_TRUE(c.congruent()) << c.reason;
    test::ExpectSameMotion(model, robot, model, variant, c, c.mappings[0], 2);
  }
}

TEST(Variants, OfAtronsMakeUpForATurnedHalfByTheJointsOffset) {
  // m2 is docked at both halves. Docked a quarter turn further on one of them, with a connector of
  // the other gender, its joint must stand a quarter turn further too.
  const model::Model model = AtronModel();
  model::Robot robot = test::RandomTree(model, 3, 4);
  const auto half = [&](int module, int d) {
    const model::Docking& docking = robot.dockings[d];
    const int connector = docking.module_a == module ? docking.connector_a : docking.connector_b;
    return model.module_types[0].connectors[connector].link;
  };
  for (uint64_t seed = 5; robot.dockings[1].module_a != 1 || half(1, 0) == half(1, 1); ++seed) {
    robot = test::RandomTree(model, 3, seed);
  }
  for (model::ModuleInstance& module : robot.modules) module.start = {0.1};
  VariantOptions options;
  options.max = 60;
  options.seed = 1;
  const std::vector<Variant> variants = Variants(model, robot, options);
  EXPECT_GT(variants.size(), 20u);
  bool quarter = false;
  for (const auto& [variant, masses] : variants) {
    const Congruence c = Compare(model, robot, model, variant);
    ASSERT_TRUE(c.congruent()) << c.reason;
    test::ExpectSameMotion(model, robot, model, variant, c, c.mappings[0], 2);
    for (const JointImage& image : c.mappings[0].joints) {
      quarter = quarter || std::abs(std::abs(image.offset) - M_PI / 2) < 1e-9;
    }
  }
  EXPECT_TRUE(quarter);
}

}  // namespace
}  // namespace morphbus::congruence
