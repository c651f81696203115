// models/mtran.m3l against the same module and robots built by hand: two routes to one model.

#include <gtest/gtest.h>

#include "compiler/m3l/compile.h"
#include "compiler/model/kinematic_graph.h"
#include "test/compiler/solver/known_modules.h"
#include "test/support/source_dir.h"

namespace morphbus::model {
namespace {

class ModelFile : public testing::Test {
 protected:
  void SetUp() override {
    m3l::CompileOutput output = m3l::CompileFiles({test::SourcePath("models/mtran.m3l")});
    ASSERT_TRUE(output.model.has_value())
        << source::Render(output.diagnostics, output.sources, false);
    model_ = std::move(*output.model);
    by_hand_ = test::MtranModel(model_.module_types[0].unit_m);
  }

  Model model_;
  Model by_hand_;
};

TEST_F(ModelFile, HasTheConnectionsOfTheModuleBuiltByHand) {
  const std::vector<ConnectionOption>& options = model_.connection_types[0].options;
  const std::vector<ConnectionOption>& expected = by_hand_.connection_types[0].options;
  ASSERT_EQ(options.size(), expected.size());
  for (size_t i = 0; i < options.size(); ++i) {
    EXPECT_EQ(options[i].connector_a, expected[i].connector_a);
    EXPECT_EQ(options[i].connector_b, expected[i].connector_b);
    EXPECT_TRUE(options[i].X_AB.isApprox(expected[i].X_AB, 1e-12));
  }
}

TEST_F(ModelFile, HasTheRobotsBuiltByHand) {
  const double unit = model_.module_types[0].unit_m;
  const Robot by_hand[] = {test::Quadruped(by_hand_, unit),
                           test::EquivalentQuadruped(by_hand_, unit)};
  for (const Robot& expected : by_hand) {
    const Robot* robot = model_.FindRobot(expected.name);
    ASSERT_NE(robot, nullptr) << expected.name;
    const KinematicState a = ForwardKinematics(model_, *robot, StartValues(*robot));
    const KinematicState b = ForwardKinematics(by_hand_, expected, StartValues(expected));
    ASSERT_EQ(a.X_RL.size(), b.X_RL.size());
    for (size_t m = 0; m < a.X_RL.size(); ++m) {
      for (size_t l = 0; l < a.X_RL[m].size(); ++l) {
        EXPECT_TRUE(a.X_RL[m][l].isApprox(b.X_RL[m][l], 1e-12));
      }
    }
    EXPECT_EQ(BuildKinematicGraph(model_, *robot).mobility, 16);
  }
}

}  // namespace
}  // namespace morphbus::model
