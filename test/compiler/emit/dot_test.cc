#include "compiler/emit/back_ends.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "test/compiler/solver/known_modules.h"

namespace morphbus::emit {
namespace {

int Count(const std::string& text, const std::string& what) {
  int count = 0;
  for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

TEST(Dot, AssemblyHasAClusterAModuleAndAnEdgeAConnection) {
  const model::Model model = test::MtranModel();
  const std::string dot = AssemblyGraphDot(model, test::Quadruped(model));
  EXPECT_EQ(Count(dot, "subgraph"), 9);
  EXPECT_EQ(Count(dot, "taillabel"), 10);
  EXPECT_EQ(Count(dot, " -- "), 10 + 18);
  EXPECT_EQ(Count(dot, "label=\"35\""), 1);
}

TEST(Dot, KinematicGraphHasAVertexABodyAndAnEdgeAJoint) {
  const model::Model model = test::MtranModel();
  const model::Robot robot = test::Quadruped(model);
  const std::string dot = KinematicGraphDot(model, robot, model::BuildKinematicGraph(model, robot));
  EXPECT_EQ(Count(dot, "shape=ellipse"), 18);
  EXPECT_EQ(Count(dot, " -- "), 18);
  EXPECT_EQ(Count(dot, "style=dashed"), 2);
  EXPECT_EQ(Count(dot, "degree 6"), 1);
  EXPECT_EQ(dot.rfind("graph \"quadruped\" {", 0), 0u);
}

TEST(Dot, QuotesNames) {
  const model::Model model = test::MtranModel();
  model::Robot robot = test::Quadruped(model);
  robot.name = "a\"b\\";
  EXPECT_EQ(AssemblyGraphDot(model, robot).rfind("graph \"a\\\"b\\\\\" {", 0), 0u);
}

}  // namespace
}  // namespace morphbus::emit
