// The generated C, compiled and loaded, against the library: joints of all types, any axis.

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <string>

#include "compiler/emit/back_ends.h"
#include "test/compiler/emit/compiled_c.h"
#include "test/compiler/emit/exported_robots.h"

namespace morphbus::emit {
namespace {

using test::CompiledC;
using test::ExportCase;
using Function = void (*)(const float* q, float (*X)[12]);

Function ForwardKinematicsIn(const CompiledC& compiled, const RobotTree& tree) {
  return reinterpret_cast<Function>(compiled.Find(tree.name + "_forward_kinematics"));
}

TEST(C99, PlacesEveryLinkWhereTheModelDoes) {
  std::mt19937 random(7);
  for (const ExportCase& robot : test::ExportCases(4)) {
    SCOPED_TRACE(robot.name);
    const RobotTree tree = TreeOf(robot.model, robot.robot);
    const CompiledC compiled(ToC(tree, "robot"), "robot");
    const Function function = ForwardKinematicsIn(compiled, tree);
    ASSERT_NE(function, nullptr);
    for (int round = 0; round < 5; ++round) {
      const model::JointValues values = test::RandomValues(robot, random);
      std::vector<float> q;
      for (const auto& module : values) q.insert(q.end(), module.begin(), module.end());
      const std::unique_ptr<float[][12]> X(new float[tree.links.size()][12]);
      function(q.data(), X.get());
      const model::KinematicState state =
          model::ForwardKinematics(robot.model, robot.robot, values);
      size_t i = 0;
      for (const auto& module : state.X_RL) {
        for (const model::Pose& expected : module) {
          const Eigen::Map<const Eigen::Matrix<float, 3, 4, Eigen::RowMajor>> actual(X[i++]);
          EXPECT_LT((actual.cast<double>() - expected.matrix().topRows<3>()).norm(), 1e-5);
        }
      }
    }
  }
}

// Longer robots are written as several functions.
TEST(C99, AChainOfTwoHundredLinksIsRight) {
  const ExportCase base = test::ExportCases(0).front();
  ExportCase chain = {"chain", base.model, {}};
  chain.robot.name = "chain";
  int option = 0;
  const auto& options = base.model.connection_types[0].options;
  while (options[static_cast<size_t>(option)].connector_a != 1 ||
         options[static_cast<size_t>(option)].connector_b != 4) {
    ++option;
  }
  for (int m = 0; m < 70; ++m) {
    chain.robot.modules.push_back({"m" + std::to_string(m), 0, {0.0, 0.0}});
    if (m > 0) chain.robot.dockings.push_back({m - 1, 1, m, 4, 0, option});
  }
  const RobotTree tree = TreeOf(chain.model, chain.robot);
  EXPECT_EQ(tree.links.size(), 210u);
  const CompiledC compiled(ToC(tree, "chain"), "chain");
  const Function function = ForwardKinematicsIn(compiled, tree);
  ASSERT_NE(function, nullptr);
  std::vector<float> q;
  model::JointValues values = model::StartValues(chain.robot);
  for (auto& module : values) {
    for (double& value : module) q.push_back(static_cast<float>(value = 0.02));
  }
  const std::unique_ptr<float[][12]> X(new float[tree.links.size()][12]);
  function(q.data(), X.get());
  const model::KinematicState state = model::ForwardKinematics(chain.model, chain.robot, values);
  const Eigen::Map<const Eigen::Matrix<float, 3, 4, Eigen::RowMajor>> last(X[209]);
  EXPECT_LT((last.cast<double>() - state.X_RL[69][2].matrix().topRows<3>()).norm(), 1e-4);
}

TEST(C99Header, NamesThatWouldBeOneIdentifierStayApart) {
  model::Model model = test::GadgetModel();
  model::Robot robot;
  robot.name = "r";
  model.module_types[0].links[0].name = "b_c";
  model.module_types[0].links[1].name = "c";
  robot.modules = {{"a", 0, {0, 0, 0, 0, 0}}, {"a_b", 0, {0, 0, 0, 0, 0}}};
  robot.dockings = {{0, 0, 1, 1, 0, 0}};
  const std::string header = ToC(TreeOf(model, robot), "r").companions.at(0).bytes;
  EXPECT_NE(header.find("r_link_a_b_c = 0,  /* a.b_c */"), std::string::npos) << header;
  EXPECT_NE(header.find("r_link_a_b_c_ = 6,  /* a_b.c */"), std::string::npos) << header;
}

}  // namespace
}  // namespace morphbus::emit
