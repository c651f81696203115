// Forward kinematics against Orocos KDL: the same random assemblies, built for KDL from the
// modules' raw numbers, link by link in order of attachment, with B's axis of each joint (the
// opposite one).

#include <gtest/gtest.h>

#include <array>
#include <kdl/tree.hpp>
#include <kdl/treefksolverpos_recursive.hpp>
#include <kdl/treejnttojacsolver.hpp>
#include <random>
#include <string>

#include "compiler/model/forward_kinematics.h"
#include "compiler/model/jacobian.h"
#include "test/compiler/solver/known_modules.h"

namespace morphbus::model {
namespace {

KDL::Vector ToKdl(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

KDL::Frame ToKdl(const Pose& X) {
  const Eigen::Matrix3d R = X.linear();
  return {KDL::Rotation(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1),
                        R(2, 2)),
          ToKdl(Eigen::Vector3d(X.translation()))};
}

std::string LinkName(int module, int link) {
  return "m" + std::to_string(module) + "/" + std::to_string(link);
}

std::string JointName(int module, int joint) {
  return "j" + std::to_string(module) + "/" + std::to_string(joint);
}

/// A random tree of modules of type 0: each hangs by a random option at a free connector.
Robot RandomTree(const Model& model, std::mt19937& random) {
  const auto below = [&](size_t n) { return static_cast<int>(random() % n); };
  Robot robot;
  robot.name = "random";
  const int count = 2 + below(11);
  std::vector<std::array<bool, 6>> used(count, std::array<bool, 6>{});
  for (int m = 0; m < count; ++m) robot.modules.push_back({"m" + std::to_string(m), 0, {0.0, 0.0}});
  for (int m = 1; m < count;) {
    const int host = below(m);
    const int option = below(model.connection_types[0].options.size());
    const ConnectionOption& o = model.connection_types[0].options[option];
    const bool hosts_a = below(2) == 0;
    const int at_host = hosts_a ? o.connector_a : o.connector_b;
    if (used[host][at_host]) continue;
    used[host][at_host] = true;
    used[m][hosts_a ? o.connector_b : o.connector_a] = true;
    Docking docking{host, o.connector_a, m, o.connector_b, 0, option};
    if (!hosts_a) std::swap(docking.module_a, docking.module_b);
    robot.dockings.push_back(docking);
    ++m;
  }
  robot.root_module = below(count);
  robot.root_link = below(3);
  robot.X_LR = Eigen::Translation3d(0.3, -0.2, 0.1) *
               Eigen::AngleAxisd(0.1 * below(60), Eigen::Vector3d(1, 2, 3).normalized());
  return robot;
}

/// Adds a module to KDL's tree, its link `entry` hung from `parent` by `X_PE`.
void AddModule(KDL::Tree& tree, const ModuleType& type, int module, int entry,
               const std::string& parent, const KDL::Frame& X_PE) {
  ASSERT_TRUE(tree.addSegment(
      KDL::Segment(LinkName(module, entry), KDL::Joint(KDL::Joint::None), X_PE), parent));
  std::vector<int> reached = {entry};
  for (size_t i = 0; i < reached.size(); ++i) {
    for (size_t j = 0; j < type.joints.size(); ++j) {
      const Joint& joint = type.joints[j];
      const bool moves_a = joint.link_b == reached[i];
      if (!moves_a && joint.link_a != reached[i]) continue;
      const int other = moves_a ? joint.link_a : joint.link_b;
      if (std::find(reached.begin(), reached.end(), other) != reached.end()) continue;
      reached.push_back(other);
      const KDL::Vector axis = ToKdl(Eigen::Vector3d(moves_a ? joint.axis : -joint.axis));
      const KDL::Joint hinge(JointName(module, static_cast<int>(j)), ToKdl(joint.p_MoJo_M), axis,
                             KDL::Joint::RotAxis);
      ASSERT_TRUE(
          tree.addSegment(KDL::Segment(LinkName(module, other), hinge, KDL::Frame::Identity()),
                          LinkName(module, reached[i])));
    }
  }
}

KDL::Tree BuildKdlTree(const Model& model, const Robot& robot) {
  KDL::Tree tree("R");
  const ModuleType& type = model.module_types[0];
  std::vector<bool> added(robot.modules.size(), false);
  AddModule(tree, type, robot.root_module, robot.root_link, "R", ToKdl(robot.X_LR).Inverse());
  added[robot.root_module] = true;
  for (bool again = true; again;) {
    again = false;
    for (const Docking& d : robot.dockings) {
      if (added[d.module_a] == added[d.module_b]) continue;
      const KDL::Frame X_AB = ToKdl(model.connection_types[0].options[d.option].X_AB);
      const int link_a = type.connectors[d.connector_a].link;
      const int link_b = type.connectors[d.connector_b].link;
      if (added[d.module_a]) {
        AddModule(tree, type, d.module_b, link_b, LinkName(d.module_a, link_a), X_AB);
      } else {
        AddModule(tree, type, d.module_a, link_a, LinkName(d.module_b, link_b), X_AB.Inverse());
      }
      added[d.module_a] = added[d.module_b] = true;
      again = true;
    }
  }
  return tree;
}

/// A random assembly at random joint values, for both.
struct KdlCase {
  /// Copying a tree renumbers its joints depth first, and the solvers work on a copy: it is
  /// numbered so before the values are entered.
  KdlCase(const Model& model, unsigned seed) : random(seed), robot(RandomTree(model, random)) {
    const KDL::Tree built = BuildKdlTree(model, robot);
    tree = KDL::Tree(built);
    EXPECT_EQ(tree.getNrOfJoints(), 2 * robot.modules.size());
    std::uniform_real_distribution<double> angle(-M_PI / 2, M_PI / 2);
    q = StartValues(robot);
    kdl_q = KDL::JntArray(tree.getNrOfJoints());
    column_of.resize(tree.getNrOfJoints());
    for (const auto& [name, element] : tree.getSegments()) {
      const std::string joint = GetTreeElementSegment(element).getJoint().getName();
      if (joint[0] != 'j') continue;
      const size_t slash = joint.find('/');
      const int m = std::stoi(joint.substr(1, slash - 1));
      const int j = std::stoi(joint.substr(slash + 1));
      q[m][j] = kdl_q(GetTreeElementQNr(element)) = angle(random);
      column_of[GetTreeElementQNr(element)] = 2 * m + j;
    }
  }

  std::mt19937 random;
  Robot robot;
  KDL::Tree tree;
  JointValues q;
  KDL::JntArray kdl_q;
  /// By KDL's number of a joint: the place of ours among the joints of all modules.
  std::vector<int> column_of;
};

TEST(ForwardKinematics, AgreesWithKdlOnTwoHundredRandomAssemblies) {
  const Model model = test::MtranModel(0.0325);
  double worst = 0.0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    const KdlCase random(model, seed);
    const KinematicState state = ForwardKinematics(model, random.robot, random.q);
    KDL::TreeFkSolverPos_recursive solver(random.tree);
    for (size_t m = 0; m < random.robot.modules.size(); ++m) {
      for (size_t l = 0; l < 3; ++l) {
        KDL::Frame expected;
        const std::string name = LinkName(static_cast<int>(m), static_cast<int>(l));
        ASSERT_EQ(solver.JntToCart(random.kdl_q, expected, name), 0);
        const KDL::Frame actual = ToKdl(state.X_RL[m][l]);
        const KDL::Twist error = KDL::diff(expected, actual);
        worst = std::max({worst, error.vel.Norm(), error.rot.Norm()});
      }
    }
    ASSERT_LT(worst, 1e-9) << "seed " << seed;
    EXPECT_EQ(state.num_loops, 0);
  }
}

TEST(Jacobian, AgreesWithKdlOnTwoHundredRandomAssemblies) {
  const Model model = test::MtranModel(0.0325);
  for (unsigned seed = 0; seed < 200; ++seed) {
    const KdlCase random(model, seed);
    KDL::TreeJntToJacSolver solver(random.tree);
    for (int m = 0; m < static_cast<int>(random.robot.modules.size()); ++m) {
      for (int l = 0; l < 3; ++l) {
        KDL::Jacobian expected(random.tree.getNrOfJoints());
        ASSERT_EQ(solver.JntToJac(random.kdl_q, expected, LinkName(m, l)), 0);
        const auto actual = Jacobian(model, random.robot, random.q, m, l);
        for (unsigned c = 0; c < expected.columns(); ++c) {
          ASSERT_LT((expected.data.col(c) - actual.col(random.column_of[c])).norm(), 1e-9)
              << "seed " << seed << ", " << LinkName(m, l);
        }
      }
    }
  }
}

}  // namespace
}  // namespace morphbus::model
