// Exported URDF as others read it: Orocos KDL, through ROS's parser, places every link where the
// model does.

#include <gtest/gtest.h>

#include <kdl/tree.hpp>
#include <kdl/treefksolverpos_recursive.hpp>
#include <kdl_parser/kdl_parser.hpp>
#include <map>
#include <random>

#include "compiler/emit/urdf.h"
#include "test/compiler/emit/exported_robots.h"

namespace morphbus::emit {
namespace {

using test::ExportCase;

KDL::Frame ToKdl(const model::Pose& X) {
  const Eigen::Matrix3d R = X.linear();
  const Eigen::Vector3d p = X.translation();
  return {KDL::Rotation(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1),
                        R(2, 2)),
          KDL::Vector(p.x(), p.y(), p.z())};
}

void ExpectSamePoses(const ExportCase& robot, std::mt19937& random) {
  const RobotTree tree = TreeOf(robot.model, robot.robot);
  const Exported urdf = ToUrdf(robot.model, tree, "robot");
  KDL::Tree parsed;
  ASSERT_TRUE(kdl_parser::treeFromString(urdf.text, parsed)) << urdf.text;
  // Copying a tree renumbers its joints, and the solver works on a copy.
  const KDL::Tree kdl(parsed);  // NOLINT(performance-unnecessary-copy-initialization)
  for (int round = 0; round < 3; ++round) {
    const model::JointValues q = test::RandomValues(robot, random);
    std::map<std::string, double> value_of;
    for (size_t m = 0; m < q.size(); ++m) {
      const model::ModuleType& type = robot.model.TypeOf(robot.robot, static_cast<int>(m));
      for (size_t j = 0; j < q[m].size(); ++j) {
        value_of[robot.robot.modules[m].name + "." + type.joints[j].name] = q[m][j];
      }
    }
    KDL::JntArray kdl_q(kdl.getNrOfJoints());
    for (const auto& [name, element] : kdl.getSegments()) {
      const KDL::Joint& joint = GetTreeElementSegment(element).getJoint();
      if (joint.getType() == KDL::Joint::None) continue;
      ASSERT_EQ(value_of.count(joint.getName()), 1u) << joint.getName();
      kdl_q(GetTreeElementQNr(element)) = value_of[joint.getName()];
    }
    const model::KinematicState state = model::ForwardKinematics(robot.model, robot.robot, q);
    KDL::TreeFkSolverPos_recursive solver(kdl);
    for (size_t m = 0; m < state.X_RL.size(); ++m) {
      for (size_t l = 0; l < state.X_RL[m].size(); ++l) {
        const std::string name = LinkName(robot, m, l);
        KDL::Frame actual;
        ASSERT_EQ(solver.JntToCart(kdl_q, actual, name), 0) << name;
        const KDL::Twist error = KDL::diff(ToKdl(state.X_RL[m][l]), actual);
        EXPECT_LT(std::max(error.vel.Norm(), error.rot.Norm()), 1e-9) << name;
      }
    }
  }
}

TEST(Urdf, KdlPlacesEveryLinkWhereTheModelDoes) {
  std::mt19937 random(1);
  for (const ExportCase& robot : test::ExportCases(30)) {
    SCOPED_TRACE(robot.name);
    ExpectSamePoses(robot, random);
  }
}

TEST(Urdf, MassesAndInertiasArriveInKdl) {
  for (const ExportCase& robot : test::ExportCases(0)) {
    const Exported urdf = ToUrdf(robot.model, TreeOf(robot.model, robot.robot), "robot");
    KDL::Tree kdl;
    ASSERT_TRUE(kdl_parser::treeFromString(urdf.text, kdl));
    for (size_t m = 0; m < robot.robot.modules.size(); ++m) {
      const model::ModuleType& type = robot.model.TypeOf(robot.robot, static_cast<int>(m));
      for (size_t l = 0; l < type.links.size(); ++l) {
        const model::LinkMass mass = model::ComputeLinkMass(type, static_cast<int>(l));
        const KDL::RigidBodyInertia actual =
            GetTreeElementSegment(kdl.getSegment(LinkName(robot, m, l))->second).getInertia();
        EXPECT_NEAR(actual.getMass(), mass.mass_kg, 1e-12);
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(actual.getCOG()(k), mass.p_LoLcm_L(k), 1e-12);
        const Eigen::Vector3d& c = mass.p_LoLcm_L;
        const Eigen::Matrix3d about_origin =
            mass.I_Lcm_L +
            mass.mass_kg * (c.squaredNorm() * Eigen::Matrix3d::Identity() - c * c.transpose());
        for (int i = 0; i < 3; ++i) {
          for (int j = 0; j < 3; ++j) {
            EXPECT_NEAR(actual.getRotationalInertia().data[3 * i + j], about_origin(i, j), 1e-12);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace morphbus::emit
