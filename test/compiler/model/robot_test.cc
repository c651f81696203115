// The robots of the paper's Fig. 9: poses, closure, kinematic graph, mobility.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "compiler/model/jacobian.h"
#include "compiler/model/kinematic_graph.h"
#include "compiler/model/kinematic_tree.h"
#include "compiler/model/loop_constraints.h"
#include "test/compiler/solver/known_modules.h"

namespace morphbus::model {
namespace {

using Eigen::Vector3d;

/// The table of module origins in the robot frame (x, z), y = 0, and which rotations are identity.
struct Expected {
  double x, z;
  bool identity;
};

void ExpectOrigins(const KinematicState& state, const std::vector<Expected>& expected,
                   double unit) {
  ASSERT_EQ(state.X_RL.size(), expected.size());
  const Eigen::Matrix3d half_turn = Eigen::AngleAxisd(M_PI, Vector3d::UnitX()).toRotationMatrix();
  for (size_t m = 0; m < expected.size(); ++m) {
    const Vector3d p(expected[m].x * unit, 0.0, expected[m].z * unit);
    const Eigen::Matrix3d R =
        expected[m].identity ? Eigen::Matrix3d(Eigen::Matrix3d::Identity()) : half_turn;
    for (const Pose& X_RL : state.X_RL[m]) {
      EXPECT_LT((X_RL.translation() - p).norm(), 1e-12) << "m" << m + 1;
      EXPECT_LT((X_RL.linear() - R).norm(), 1e-12) << "m" << m + 1;
    }
  }
}

TEST(Quadrupeds, StandWhereThePaperPutsThem) {
  for (const double unit : {1.0, 0.0325}) {
    const Model model = test::MtranModel(unit);
    const Robot quadruped = test::Quadruped(model, unit);
    KinematicState state = ForwardKinematics(model, quadruped, StartValues(quadruped));
    ExpectOrigins(state,
                  {{5, -2, true},
                   {1, -2, false},
                   {-3, -2, true},
                   {-7, -2, false},
                   {-1, 0, true},
                   {5, 2, true},
                   {1, 2, false},
                   {-3, 2, true},
                   {-7, 2, false}},
                  unit);
    EXPECT_LT(state.closure_m, 1e-12);
    EXPECT_LT(state.closure_rad, 1e-12);
    const Robot other = test::EquivalentQuadruped(model, unit);
    state = ForwardKinematics(model, other, StartValues(other));
    ExpectOrigins(state,
                  {{5, 2, true},
                   {1, 2, false},
                   {-3, 2, true},
                   {-7, 2, true},
                   {-1, 0, true},
                   {5, -2, false},
                   {1, -2, false},
                   {-3, -2, true},
                   {-7, -2, false}},
                  unit);
    EXPECT_LT(state.closure_m, 1e-12);
    EXPECT_LT(state.closure_rad, 1e-12);
  }
}

TEST(Quadrupeds, HaveSixteenDegreesOfFreedomAndALockedMiddle) {
  const Model model = test::MtranModel();
  for (const Robot& robot : {test::Quadruped(model), test::EquivalentQuadruped(model)}) {
    const KinematicGraph graph = BuildKinematicGraph(model, robot);
    EXPECT_EQ(graph.mobility, 16);
    EXPECT_TRUE(graph.locked_computed);
    ASSERT_EQ(graph.joints.size(), 18u);
    for (const GraphJoint& joint : graph.joints) EXPECT_EQ(joint.locked, joint.module == 4);
  }
}

TEST(Quadrupeds, HaveThePapersAdjacencyAndDegrees) {
  const Model model = test::MtranModel();
  for (const Robot& robot : {test::Quadruped(model), test::EquivalentQuadruped(model)}) {
    const KinematicGraph graph = BuildKinematicGraph(model, robot);
    std::map<int, int> degrees;
    int hub = 0;
    for (const Body& body : graph.bodies) {
      ++degrees[body.degree];
      if (body.links.size() == 6) hub = body.degree;
    }
    EXPECT_EQ(hub, 6);
    // Four feet, four knee-hip bodies and nine bars, one hub.
    EXPECT_EQ(degrees, (std::map<int, int>{{1, 4}, {2, 13}, {6, 1}}));
    std::map<size_t, int> adjacent;
    for (const GraphJoint& joint : graph.joints) {
      ++adjacent[joint.adjacent.size()];
      EXPECT_EQ(static_cast<size_t>(joint.num_adjacent), joint.adjacent.size());
      EXPECT_EQ(joint.adjacent.size() == 5, joint.module == 4);
      for (const AxisRelation relation : joint.adjacent_axes) {
        EXPECT_EQ(relation, AxisRelation::kParallel);
      }
    }
    EXPECT_EQ(adjacent, (std::map<size_t, int>{{1, 4}, {2, 8}, {5, 2}, {6, 4}}));
  }
}

TEST(ForwardKinematics, OpensALoopWhenALockedJointIsDriven) {
  const Model model = test::MtranModel();
  const Robot robot = test::Quadruped(model);
  JointValues q = StartValues(robot);
  q[0][0] = 0.7;  // a leg: no loop
  EXPECT_LT(ForwardKinematics(model, robot, q).closure_m, 1e-12);
  q[4][1] = 0.1;  // of m5, between hub and bar
  const KinematicState state = ForwardKinematics(model, robot, q);
  EXPECT_GT(state.closure_m, 0.05);
  EXPECT_NEAR(state.closure_rad, 0.1, 1e-9);
}

TEST(JointMotion, TurnsAAgainstBByTheRightHandRule) {
  const ModuleType type = test::Mtran();
  const std::vector<Pose> X_BL = LinkPoses(type, {M_PI / 2, 0.0}, 2);
  // About +z through (-1, 0, 0), a quarter turn takes (-2, 0, 0) to (-1, -1, 0).
  EXPECT_LT((X_BL[0] * Vector3d(-2, 0, 0) - Vector3d(-1, -1, 0)).norm(), 1e-12);
  // Seen from the block, the bar turns the other way.
  const std::vector<Pose> X_AL = LinkPoses(type, {M_PI / 2, 0.0}, 0);
  EXPECT_LT((X_AL[2].matrix() - X_BL[0].inverse().matrix()).norm(), 1e-12);
}

/// Every kind of joint, and axes that are no coordinate axes, in one module.
ModuleType OddModule() {
  ModuleType type;
  type.name = "ODD";
  for (const char* name : {"base", "slider", "turret", "tip", "tail"}) {
    Link link;
    link.name = name;
    type.links.push_back(link);
  }
  const auto add = [&](JointType kind, int a, int b, const Vector3d& o, const Vector3d& axis) {
    Joint joint;
    joint.name = "j" + std::to_string(type.joints.size());
    joint.type = kind;
    joint.link_a = a;
    joint.link_b = b;
    joint.p_MoJo_M = o;
    joint.axis = axis.normalized();
    type.joints.push_back(joint);
  };
  add(JointType::kPrismatic, 1, 0, {0, 0, 0}, {1, 2, 0});
  add(JointType::kContinuous, 1, 2, {0.3, 0, 0.1}, {1, 1, 1});
  add(JointType::kRevolute, 3, 2, {0, 1, 0}, {0, -1, 0});
  add(JointType::kFixed, 4, 3, {0, 0, 0}, {1, 0, 0});
  return type;
}

TEST(KinematicTree, AgreesWithJointMotionForEveryKindOfJoint) {
  Model model;
  model.module_types = {OddModule()};
  Robot robot;
  robot.modules = {{"m1", 0, {0, 0, 0, 0}}};
  std::mt19937 random(1);
  std::uniform_real_distribution<double> angle(-3.0, 3.0);
  for (int root = 0; root < 5; ++root) {
    robot.root_link = root;
    robot.X_LR = Pose(Eigen::Translation3d(1, 2, 3)) * Eigen::AngleAxisd(0.4, Vector3d::UnitY());
    const std::vector<double> q = {angle(random), angle(random), angle(random), 0.0};
    const std::vector<Pose> direct = LinkPoses(model.module_types[0], q, root);
    const KinematicState state = ForwardKinematics(model, robot, {q});
    for (int l = 0; l < 5; ++l) {
      const Pose expected = robot.X_LR.inverse() * direct[l];
      EXPECT_LT((state.X_RL[0][l].matrix() - expected.matrix()).norm(), 1e-12);
    }
  }
}

TEST(Jacobian, IsTheDerivativeOfForwardKinematicsForEveryKindOfJoint) {
  Model model;
  model.module_types = {OddModule()};
  Robot robot;
  robot.modules = {{"m1", 0, {0, 0, 0, 0}}};
  robot.X_LR = Pose(Eigen::Translation3d(1, 2, 3)) * Eigen::AngleAxisd(0.4, Vector3d::UnitY());
  const JointValues q = {{0.3, -0.8, 1.1, 0.0}};
  constexpr double kStep = 1e-6;
  for (int root = 0; root < 5; ++root) {
    robot.root_link = root;
    const KinematicState at = ForwardKinematics(model, robot, q);
    for (int l = 0; l < 5; ++l) {
      const auto jacobian = Jacobian(model, robot, q, 0, l);
      ASSERT_EQ(jacobian.cols(), 4);
      for (int j = 0; j < 4; ++j) {
        JointValues moved = q;
        moved[0][j] += kStep;
        const Pose& X_0 = at.X_RL[0][l];
        const Pose X_1 = ForwardKinematics(model, robot, moved).X_RL[0][l];
        const Eigen::AngleAxisd turn(Eigen::Matrix3d(X_1.linear() * X_0.linear().transpose()));
        const Vector3d velocity = (X_1.translation() - X_0.translation()) / kStep;
        const Vector3d angular = turn.angle() * turn.axis() / kStep;
        EXPECT_LT((jacobian.col(j).head<3>() - velocity).norm(), 1e-5) << root << " " << l << j;
        EXPECT_LT((jacobian.col(j).tail<3>() - angular).norm(), 1e-5) << root << " " << l << j;
      }
    }
  }
}

TEST(KinematicGraph, FixedJointsBelongToBodies) {
  Model model;
  model.module_types = {OddModule()};
  Robot robot;
  robot.modules = {{"m1", 0, {0, 0, 0, 0}}};
  const KinematicGraph graph = BuildKinematicGraph(model, robot);
  EXPECT_EQ(graph.bodies.size(), 4u);
  EXPECT_EQ(graph.joints.size(), 3u);
  EXPECT_EQ(graph.mobility, 3);
}

TEST(LoopMobility, OfAPlanarFourBarIsOne) {
  const Vector3d z = Vector3d::UnitZ();
  const std::vector<ScrewJoint> joints = {{0, 1, false, z, {0, 0, 0}},
                                          {1, 2, false, z, {0.2, 1, 0}},
                                          {2, 3, false, -z, {1.3, 0.9, 0}},
                                          {3, 0, false, z, {1, 0, 0}}};
  const LoopMobility loop = ComputeLoopMobility(4, joints);
  EXPECT_EQ(loop.mobility, 1);
  EXPECT_EQ(loop.locked, std::vector<bool>(4, false));
}

TEST(LoopMobility, OfATriangleIsNoneAndABridgeStaysFree) {
  const Vector3d z = Vector3d::UnitZ();
  const std::vector<ScrewJoint> joints = {{0, 1, false, z, {0, 0, 0}},
                                          {1, 2, false, z, {1, 0, 0}},
                                          {2, 0, false, z, {0, 1, 0}},
                                          {2, 3, false, z, {5, 5, 0}}};
  const LoopMobility loop = ComputeLoopMobility(4, joints);
  EXPECT_EQ(loop.mobility, 1);
  EXPECT_EQ(loop.locked, (std::vector<bool>{true, true, true, false}));
  EXPECT_EQ(BiconnectedParts(4, joints), (std::vector<std::vector<int>>{{0, 1, 2}, {3}}));
}

TEST(LoopMobility, OfASarrusLinkageIsOneAgainstGruebler) {
  // Two triples of parallel hinges, crosswise; Gruebler says 0, it moves by one.
  const Vector3d x = Vector3d::UnitX();
  const Vector3d y = Vector3d::UnitY();
  const std::vector<ScrewJoint> sarrus = {
      {0, 1, false, x, {0, 1, 0}}, {1, 2, false, x, {0, 1.5, 0.5}}, {2, 3, false, x, {0, 1, 1}},
      {3, 4, false, y, {1, 0, 1}}, {4, 5, false, y, {1.5, 0, 0.5}}, {5, 0, false, y, {1, 0, 0}}};
  EXPECT_EQ(ComputeLoopMobility(6, sarrus).mobility, 1);
}

/// The four hinges of a closed linkage of links with lengths a, b, a, b and twists alpha, beta,
/// alpha, beta (rad), the first hinge turned by `theta`. It closes if sin(alpha)/a = sin(beta)/b
/// (Bennett, "A new mechanism", Engineering 76, 1903), for then opposite angles are negatives of
/// each other and tan(theta1/2) tan(theta2/2) = sin((beta+alpha)/2) / sin((beta-alpha)/2).
std::vector<ScrewJoint> BennettLinkage(double a, double alpha, double b, double beta, double theta,
                                       double* gap) {
  const double ratio = std::sin((beta + alpha) / 2) / std::sin((beta - alpha) / 2);
  const double theta2 = 2 * std::atan(ratio / std::tan(theta / 2));
  std::vector<ScrewJoint> joints;
  Pose X = Pose::Identity();  // The frame of hinge i, turning about its z.
  for (int i = 0; i < 4; ++i) {
    joints.push_back({(i + 3) % 4, i, false, X.linear().col(2), X.translation()});
    const double angle = (i < 2 ? 1 : -1) * (i % 2 == 0 ? theta : theta2);
    X = X * Eigen::AngleAxisd(angle, Vector3d::UnitZ()) *
        Eigen::Translation3d(i % 2 == 0 ? a : b, 0, 0) *
        Eigen::AngleAxisd(i % 2 == 0 ? alpha : beta, Vector3d::UnitX());
  }
  *gap = (X.matrix() - Eigen::Matrix4d::Identity()).norm();
  return joints;
}

TEST(LoopMobility, OfABennettLinkageIsOneAgainstGruebler) {
  // Four hinges, no two of them parallel or meeting: Gruebler says -2.
  const double a = 1.0, alpha = 0.5, beta = 1.1;
  const double b = a * std::sin(beta) / std::sin(alpha);
  double gap = 1.0;
  for (const double theta : {0.7, 1.3, 2.5}) {
    const std::vector<ScrewJoint> bennett = BennettLinkage(a, alpha, b, beta, theta, &gap);
    EXPECT_LT(gap, 1e-12) << theta;
    const LoopMobility loop = ComputeLoopMobility(4, bennett);
    EXPECT_EQ(loop.mobility, 1) << theta;
    EXPECT_EQ(loop.locked, std::vector<bool>(4, false)) << theta;
  }
}

TEST(LoopMobility, OfFourHingesThatBreakBennettsConditionIsNone) {
  double gap = 0.0;
  const std::vector<ScrewJoint> unlike = BennettLinkage(1.0, 0.5, 1.5, 1.1, 1.3, &gap);
  EXPECT_GT(gap, 0.1);
  const LoopMobility loop = ComputeLoopMobility(4, unlike);
  EXPECT_EQ(loop.mobility, 0);
  EXPECT_EQ(loop.locked, std::vector<bool>(4, true));
}

TEST(LoopMobility, LocksAHingeWithBothEndsOnOneBody) {
  const std::vector<ScrewJoint> joints = {{0, 0, false, Vector3d::UnitX(), {0, 0, 0}}};
  const LoopMobility loop = ComputeLoopMobility(1, joints);
  EXPECT_EQ(loop.mobility, 0);
  EXPECT_TRUE(loop.locked[0]);
}

TEST(LoopMobility, IsNotComputedAboveFiveHundredJointsInOnePart) {
  std::vector<ScrewJoint> ring;
  const int n = kMaxLoopJoints + 1;
  for (int i = 0; i < n; ++i) {
    ring.push_back({i, (i + 1) % n, false, Vector3d::UnitZ(), {1.0 * i, 0, 0}});
  }
  ring.push_back({0, n, false, Vector3d::UnitZ(), {0, 1, 0}});
  const LoopMobility loop = ComputeLoopMobility(n + 1, ring);
  EXPECT_FALSE(loop.computed);
  EXPECT_EQ(loop.mobility, 1) << "the bridge alone";
  ring.erase(ring.begin());
  ring[0].body_a = 0;  // close it again with one joint fewer
  const LoopMobility exact = ComputeLoopMobility(n + 1, ring);
  EXPECT_TRUE(exact.computed);
  EXPECT_EQ(exact.mobility, n - 1 - 2 + 1) << "all hinge points on a line: two closure equations";
}

TEST(ClassifyAxes, TellsTheFourRelationsApart) {
  const Vector3d o(0, 0, 0);
  const Vector3d x = Vector3d::UnitX();
  const Vector3d slanted = Vector3d(1, 1, 0).normalized();
  EXPECT_EQ(ClassifyAxes(o, x, {0, 1, 0}, -x, 1.0), AxisRelation::kParallel);
  EXPECT_EQ(ClassifyAxes(o, x, {0, 0, 1}, Vector3d::UnitY(), 1.0), AxisRelation::kOrthogonal);
  EXPECT_EQ(ClassifyAxes(o, x, {5, 2, 0}, slanted, 1.0), AxisRelation::kCoplanar);
  EXPECT_EQ(ClassifyAxes(o, x, {5, 2, 0.1}, slanted, 1.0), AxisRelation::kSkew);
}

TEST(Bodies, AreNumberedByFirstAppearance) {
  const Model model = test::MtranModel();
  const Robot robot =
      test::Assemble(model, "pair", 2, {{"m2", "c2", "m1", "c5", {}}}, 0, 0, Pose::Identity());
  EXPECT_EQ(BodiesOf(model, robot), (std::vector<std::vector<int>>{{0, 1, 2}, {1, 3, 4}}));
}

}  // namespace
}  // namespace morphbus::model
