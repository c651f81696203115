// What holds of every assembly: it is congruent to itself and to a relabelled copy, and bodies move
// alike under every mapping that is found (by forward kinematics, at random joint values).

#include <gtest/gtest.h>

#include "compiler/congruence/congruence.h"
#include "compiler/model/kinematic_graph.h"
#include "test/compiler/congruence/assemblies.h"
#include "test/compiler/solver/known_modules.h"
#include "test/support/toy_model.h"

namespace morphbus::congruence {
namespace {

void ExpectCongruent(const model::Model& model, const model::Robot& a, const model::Robot& b,
                     uint64_t seed) {
  const Congruence c = Compare(model, a, model, b);
  ASSERT_TRUE(c.congruent()) << c.reason;
  EXPECT_TRUE(c.masses.masses_equal) << c.masses.mass_difference;
  EXPECT_TRUE(c.masses.hulls_equal) << c.masses.hull_difference;
  size_t looked_at = 0;
  for (const Mapping& mapping : c.mappings) {
    if (++looked_at > 8) break;
    test::ExpectSameMotion(model, a, model, b, c, mapping, seed);
  }
}

TEST(RandomAssemblies, OfEveryKindOfJointAreCongruentToThemselvesAndToRelabelledCopies) {
  const model::Model model = test::ToyModel();
  for (uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    const model::Robot robot = test::RandomRobot(model, 1 + static_cast<int>(seed % 17), 0, seed);
    ExpectCongruent(model, robot, robot, seed);
    ExpectCongruent(model, robot, test::Relabelled(model, robot, seed + 1000), seed);
  }
}

TEST(RandomAssemblies, OfMtransAreCongruentToThemselvesAndToRelabelledCopies) {
  const model::Model& model = test::MtranFile();
  for (uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    const model::Robot robot = test::RandomTree(model, 1 + static_cast<int>(seed % 25), seed);
    ExpectCongruent(model, robot, robot, seed);
    ExpectCongruent(model, robot, test::Relabelled(model, robot, seed + 1000), seed);
  }
}

TEST(RandomAssemblies, OfMtransWithOneConnectionTurnedMoveAlikeIfTheyAreCongruent) {
  // A turn may give the same kinematics, or not: both happen, and the answer is checked by motion.
  const model::Model& model = test::MtranFile();
  int congruent = 0;
  int different = 0;
  for (uint64_t seed = 1; seed <= 80; ++seed) {
    SCOPED_TRACE(seed);
    const model::Robot robot = test::RandomTree(model, 2 + static_cast<int>(seed % 12), seed);
    model::Robot turned = robot;
    model::Docking& docking = turned.dockings[seed % turned.dockings.size()];
    const int first = docking.option / 4 * 4;
    docking.option = first + (docking.option + 1 + static_cast<int>(seed % 3)) % 4;
    const Congruence c = Compare(model, robot, model, turned);
    ASSERT_TRUE(c.decided);
    if (!c.congruent()) {
      ++different;
      EXPECT_FALSE(c.reason.empty());
      continue;
    }
    ++congruent;
    for (const Mapping& mapping : c.mappings) {
      test::ExpectSameMotion(model, robot, model, turned, c, mapping, seed);
    }
    // Congruence goes both ways, and in as many ways.
    EXPECT_EQ(Compare(model, turned, model, robot).count, c.count);
  }
  EXPECT_GT(congruent, 5);
  EXPECT_GT(different, 5);
}

TEST(RandomAssemblies, OfAThousandModulesAreDecided) {
  const model::Model& model = test::MtranFile();
  const model::Robot tree = test::RandomTree(model, 1000, 5);
  const Congruence c = Compare(model, tree, model, test::Relabelled(model, tree, 6));
  EXPECT_TRUE(c.congruent()) << c.reason;
  std::vector<test::Mating> matings;
  for (int m = 1; m < 1000; ++m) {
    matings.push_back({"m" + std::to_string(m), "c2", "m" + std::to_string(m + 1), "c5", {}});
  }
  const model::Robot chain =
      test::Assemble(model, "chain", 1000, matings, 499, 0, model::Pose::Identity());
  EXPECT_EQ(Compare(model, chain, model, chain).count, 4);
  model::Robot bent = chain;
  ++bent.dockings[500].option;
  EXPECT_FALSE(Compare(model, chain, model, bent).congruent());
}

}  // namespace
}  // namespace morphbus::congruence
