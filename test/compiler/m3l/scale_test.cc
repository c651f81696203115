// Assemblies of 10,000 modules go through the compiler, forward kinematics and the kinematic graph.
// How long that takes is measured by scale_bench.

#include <gtest/gtest.h>

#include <string>

#include "compiler/congruence/congruence.h"
#include "compiler/m3l/compile.h"
#include "compiler/model/kinematic_graph.h"
#include "compiler/model/kinematic_tree.h"
#include "test/support/large_robots.h"

namespace morphbus::m3l {
namespace {

constexpr int kModules = 10'000;

class Large : public testing::TestWithParam<test::LargeShape> {};

TEST_P(Large, AssembliesGoThroughTheWholeCompiler) {
  const CompileOutput output = CompileText("large.m3l", test::LargeRobotText(GetParam(), kModules));
  ASSERT_TRUE(output.model.has_value())
      << source::Render(output.diagnostics, output.sources, false).substr(0, 2000);
  // Nothing overlaps, so there is nothing to warn of.
  EXPECT_EQ(output.diagnostics.all().size(), 0u);
  const model::Robot& robot = *output.model->FindRobot("large");
  ASSERT_EQ(robot.modules.size(), static_cast<size_t>(kModules));

  const model::KinematicState state =
      model::ForwardKinematics(*output.model, robot, model::StartValues(robot));
  EXPECT_LT(state.closure_m, 1e-9);
  const model::KinematicGraph graph = model::BuildKinematicGraph(*output.model, robot);
  EXPECT_EQ(graph.joints.size(), 2u * kModules);
  int64_t degrees = 0;
  for (const model::Body& body : graph.bodies) degrees += body.degree;
  EXPECT_EQ(degrees, 4 * kModules) << "no joint has both ends on one body";
  if (GetParam() == test::LargeShape::kChain) {
    EXPECT_EQ(graph.mobility, 2 * kModules);
    // All straight: one unit is two cubes of 65 mm.
    EXPECT_NEAR(state.X_RL[kModules - 1][0].translation().x(), -0.13 * (kModules - 1), 1e-6);
    EXPECT_EQ(congruence::Compare(*output.model, robot, *output.model, robot).count, 4);
  }
  if (GetParam() == test::LargeShape::kTree) {
    EXPECT_EQ(robot.dockings.size(), kModules - 1u);
  }
  if (GetParam() == test::LargeShape::kLattice) {
    // One body holds both blocks of almost every module; lists of its joints' neighbours would be
    // longer than memory.
    EXPECT_FALSE(graph.adjacency_listed);
    EXPECT_GT(graph.joints[0].num_adjacent, kModules);
    EXPECT_GT(robot.dockings.size(), 2u * kModules);
  }
}

std::string NameOf(const testing::TestParamInfo<test::LargeShape>& shape) {
  switch (shape.param) {
    case test::LargeShape::kChain:
      return "Chain";
    case test::LargeShape::kLattice:
      return "Lattice";
    case test::LargeShape::kTree:
      return "Tree";
  }
  return "";
}

INSTANTIATE_TEST_SUITE_P(Shapes, Large,
                         testing::Values(test::LargeShape::kChain, test::LargeShape::kLattice,
                                         test::LargeShape::kTree),
                         NameOf);

}  // namespace
}  // namespace morphbus::m3l
