// Exported URDF as others read it: Orocos KDL, through ROS's parser, places every link where the
// model does.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <kdl/tree.hpp>
#include <kdl/treefksolverpos_recursive.hpp>
#include <kdl_parser/kdl_parser.hpp>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "compiler/emit/back_ends.h"
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

/// A URDF in KDL at given joint values: poses by name of link, in the robot frame.
class Placed {
 public:
  Placed(const ExportCase& robot, const KDL::Tree& kdl, const model::JointValues& q)
      : kdl_(kdl), solver_(kdl_), values_(kdl_.getNrOfJoints()) {
    std::map<std::string, double> value_of;
    for (size_t m = 0; m < q.size(); ++m) {
      const model::ModuleType& type = robot.model.TypeOf(robot.robot, static_cast<int>(m));
      for (size_t j = 0; j < q[m].size(); ++j) {
        value_of[robot.robot.modules[m].name + "." + type.joints[j].name] = q[m][j];
      }
    }
    for (const auto& [name, element] : kdl_.getSegments()) {
      const KDL::Joint& joint = GetTreeElementSegment(element).getJoint();
      if (joint.getType() == KDL::Joint::None) continue;
      EXPECT_EQ(value_of.count(joint.getName()), 1u) << joint.getName();
      values_(GetTreeElementQNr(element)) = value_of[joint.getName()];
    }
  }

  KDL::Frame X_RL(const std::string& link) {
    KDL::Frame X_WR, X_WL;
    EXPECT_EQ(solver_.JntToCart(values_, X_WR, "robot_frame"), 0);
    EXPECT_EQ(solver_.JntToCart(values_, X_WL, link), 0) << link;
    return X_WR.Inverse() * X_WL;
  }

 private:
  // Copying a tree renumbers its joints, and the solver works on a copy.
  const KDL::Tree kdl_;
  KDL::TreeFkSolverPos_recursive solver_;
  KDL::JntArray values_;
};

double Gap(const KDL::Frame& X, const KDL::Frame& Y) {
  const KDL::Twist error = KDL::diff(X, Y);
  return std::max(error.vel.Norm(), error.rot.Norm());
}

KDL::Tree Parse(const ExportCase& robot) {
  const Exported urdf = ToUrdf(robot.model, OpenTreeOf(robot.model, robot.robot), {"robot", ""});
  KDL::Tree kdl;
  EXPECT_TRUE(kdl_parser::treeFromString(urdf.text, kdl)) << urdf.text;
  return kdl;
}

void ExpectSamePoses(const ExportCase& robot, const KDL::Tree& kdl, const model::JointValues& q) {
  const model::KinematicState state = model::ForwardKinematics(robot.model, robot.robot, q);
  Placed placed(robot, kdl, q);
  for (size_t m = 0; m < state.X_RL.size(); ++m) {
    for (size_t l = 0; l < state.X_RL[m].size(); ++l) {
      const std::string name = LinkName(robot, m, l);
      EXPECT_LT(Gap(ToKdl(state.X_RL[m][l]), placed.X_RL(name)), 1e-9) << name;
    }
  }
}

TEST(Urdf, KdlPlacesEveryLinkWhereTheModelDoes) {
  std::mt19937 random(1);
  for (const ExportCase& robot : test::ExportCases(30)) {
    SCOPED_TRACE(robot.name);
    const KDL::Tree kdl = Parse(robot);
    if (TreeOf(robot.model, robot.robot).loops.empty()) {
      for (int round = 0; round < 3; ++round) {
        ExpectSamePoses(robot, kdl, test::RandomValues(robot, random));
      }
    } else if (robot.name != "gadgets") {  // Its loop does not close at its start values.
      ExpectSamePoses(robot, kdl, model::StartValues(robot.robot));
    }
  }
}

/// Loops do not close at random values, so that it matters where the tree is open: everywhere else
/// a connection holds as in the model, and a joint moves its links as in the model.
TEST(Urdf, AllThatIsNotCutHoldsAtAnyJointValues) {
  std::mt19937 random(5);
  for (const ExportCase& robot : test::ExportCases(0)) {
    SCOPED_TRACE(robot.name);
    std::set<std::string> cut;
    for (const TreeLoop& loop : OpenTreeOf(robot.model, robot.robot).loops) {
      if (loop.loss != TreeLoop::Loss::kNothing) cut.insert(loop.name);
    }
    const model::JointValues q = test::RandomValues(robot, random);
    Placed placed(robot, Parse(robot), q);
    for (const model::Docking& d : robot.robot.dockings) {
      const size_t a = static_cast<size_t>(d.module_a);
      const size_t b = static_cast<size_t>(d.module_b);
      const model::Connector& connector_a = robot.model.TypeOf(robot.robot, d.module_a)
                                                .connectors[static_cast<size_t>(d.connector_a)];
      const model::Connector& connector_b = robot.model.TypeOf(robot.robot, d.module_b)
                                                .connectors[static_cast<size_t>(d.connector_b)];
      const std::string name = robot.robot.modules[a].name + "." + connector_a.name + "-" +
                               robot.robot.modules[b].name + "." + connector_b.name;
      if (cut.count(name) != 0) continue;
      const model::Pose& X_AB = robot.model.connection_types[static_cast<size_t>(d.connection_type)]
                                    .options[static_cast<size_t>(d.option)]
                                    .X_AB;
      const KDL::Frame X_RA =
          placed.X_RL(LinkName(robot, a, static_cast<size_t>(connector_a.link)));
      const KDL::Frame X_RB =
          placed.X_RL(LinkName(robot, b, static_cast<size_t>(connector_b.link)));
      EXPECT_LT(Gap(X_RA * ToKdl(X_AB), X_RB), 1e-9) << name;
    }
    for (size_t m = 0; m < q.size(); ++m) {
      const model::ModuleType& type = robot.model.TypeOf(robot.robot, static_cast<int>(m));
      for (size_t j = 0; j < type.joints.size(); ++j) {
        const model::Joint& joint = type.joints[j];
        const std::string name = robot.robot.modules[m].name + "." + joint.name;
        if (cut.count(name) != 0) continue;
        const KDL::Frame X_RA = placed.X_RL(LinkName(robot, m, static_cast<size_t>(joint.link_a)));
        const KDL::Frame X_RB = placed.X_RL(LinkName(robot, m, static_cast<size_t>(joint.link_b)));
        EXPECT_LT(Gap(X_RB * ToKdl(model::JointMotion(joint, q[m][j])), X_RA), 1e-9) << name;
      }
    }
  }
}

TEST(Urdf, LoopsAreOpenedWhereLeastIsLost) {
  using Loss = TreeLoop::Loss;
  for (const ExportCase& robot : test::ExportCases(0)) {
    SCOPED_TRACE(robot.name);
    const RobotTree tree = OpenTreeOf(robot.model, robot.robot);
    std::map<Loss, std::vector<std::string>> lost;
    for (const TreeLoop& loop : tree.loops) lost[loop.loss].push_back(loop.name);
    if (robot.name == "quadruped" || robot.name == "equivalent") {
      // One of the six connections of the hub is redundant; m5's joints lie in a loop with it.
      ASSERT_EQ(tree.loops.size(), 2u);
      EXPECT_EQ(lost[Loss::kNothing].size(), 1u);
      EXPECT_EQ(lost[Loss::kLockedJoint].size(), 1u);
      EXPECT_EQ(lost[Loss::kLockedJoint].at(0).substr(0, 3), "m5.");
      const Exported urdf = ToUrdf(robot.model, tree, {"robot", ""});
      EXPECT_EQ(urdf.warnings.size(), 3u);  // The third: m5's other joint can move here.
    } else if (robot.name == "mtran_robots.m3l caterpillar") {
      // All of its joints move, so a connection goes. m4.c2-m5.c5 and m5.c2-m6.c5 are equally far
      // from the root, m1; of equals the one declared last goes.
      ASSERT_EQ(tree.loops.size(), 1u);
      ASSERT_EQ(lost[Loss::kLoop].size(), 1u);
      EXPECT_EQ(tree.loops[0].name, "m5.c2-m6.c5");
    } else if (robot.name == "ckbot.m3l loop") {
      ASSERT_EQ(tree.loops.size(), 1u);
      EXPECT_LT(tree.loops[0].joint, 0);
    }
  }
}

/// Mass properties at density 1 of a closed mesh, as a sum over the tetrahedra between its
/// triangles and the origin (F. Tonon, "Explicit exact formulas for the 3-D tetrahedron inertia
/// tensor", 2004).
struct Solid {
  double volume = 0.0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();   ///< Integral of x.
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();  ///< Integral of x x'.
};

Solid SolidOf(const std::string& stl) {
  Solid solid;
  const auto number = [&](size_t at) {
    float value;
    std::memcpy(&value, stl.data() + at, sizeof value);
    return static_cast<double>(value);
  };
  for (size_t at = 84; at + 50 <= stl.size(); at += 50) {
    Eigen::Matrix3d corners;  // One a column.
    for (int k = 0; k < 9; ++k)
      corners(k % 3, k / 3) = number(at + 12 + 4 * static_cast<size_t>(k));
    const double volume = corners.determinant() / 6.0;
    const Eigen::Vector3d sum = corners.rowwise().sum();
    solid.volume += volume;
    solid.first += volume / 4.0 * sum;
    solid.second += volume / 20.0 * (corners * corners.transpose() + sum * sum.transpose());
  }
  return solid;
}

// The masses are those declared; where they lie is computed here from the exported meshes. Those
// hold single precision.
TEST(Urdf, MassesAndInertiasAreThoseOfTheMeshes) {
  int links = 0;
  for (const ExportCase& robot : test::ExportCases(0)) {
    SCOPED_TRACE(robot.name);
    const Exported urdf = ToUrdf(robot.model, OpenTreeOf(robot.model, robot.robot), {"robot", ""});
    std::map<std::string, Solid> solids;
    for (const CompanionFile& file : urdf.companions) {
      if (file.path.ends_with(".stl")) solids[file.path] = SolidOf(file.bytes);
    }
    KDL::Tree kdl;
    ASSERT_TRUE(kdl_parser::treeFromString(urdf.text, kdl));
    for (size_t m = 0; m < robot.robot.modules.size(); ++m) {
      const model::ModuleType& type = robot.model.TypeOf(robot.robot, static_cast<int>(m));
      for (size_t l = 0; l < type.links.size(); ++l) {
        SCOPED_TRACE(LinkName(robot, m, l));
        const KDL::RigidBodyInertia actual =
            GetTreeElementSegment(kdl.getSegment(LinkName(robot, m, l))->second).getInertia();
        EXPECT_NEAR(actual.getMass(), type.links[l].mass_kg, 1e-12);
        if (type.links[l].hull.empty()) continue;
        // The file of its only part, or one for each of several.
        const std::string mesh = "robot_meshes/" + type.name + "." + type.links[l].name;
        Solid solid;
        for (const auto& [path, part] : solids) {
          if (path != mesh + ".stl" && !path.starts_with(mesh + ".part")) continue;
          solid.volume += part.volume;
          solid.first += part.first;
          solid.second += part.second;
        }
        ASSERT_GT(solid.volume, 0.0);
        const double density = type.links[l].mass_kg / solid.volume;
        const Eigen::Matrix3d expected =
            density * (solid.second.trace() * Eigen::Matrix3d::Identity() - solid.second);
        const Eigen::Vector3d centre = solid.first / solid.volume;
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(actual.getCOG()(k), centre(k), 1e-6);
        for (int i = 0; i < 3; ++i) {
          for (int j = 0; j < 3; ++j) {
            EXPECT_NEAR(actual.getRotationalInertia().data[3 * i + j], expected(i, j),
                        1e-5 * expected.trace());
          }
        }
        ++links;
      }
    }
  }
  EXPECT_GT(links, 100);
}

TEST(Urdf, StartValuesAreReportedAsLost) {
  for (const ExportCase& robot : test::ExportCases(0)) {
    SCOPED_TRACE(robot.name);
    const RobotTree tree = OpenTreeOf(robot.model, robot.robot);
    const bool starts = std::any_of(tree.joints.begin(), tree.joints.end(),
                                    [](const TreeJoint& joint) { return joint.start != 0.0; });
    const Exported urdf = ToUrdf(robot.model, tree, {"robot", ""});
    const bool said =
        std::any_of(urdf.warnings.begin(), urdf.warnings.end(), [](const std::string& warning) {
          return warning.find("no start values") != std::string::npos;
        });
    EXPECT_EQ(said, starts);
  }
}

}  // namespace
}  // namespace morphbus::emit
