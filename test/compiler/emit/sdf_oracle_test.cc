// Exported SDF as libsdformat, Gazebo's own parser, reads it, with every warning an error.

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <sdf/sdf.hh>

#include "compiler/emit/back_ends.h"
#include "test/compiler/emit/exported_robots.h"
#include "test/support/compiled.h"

namespace morphbus::emit {
namespace {

using test::ExportCase;

void ParseStrictly(const std::string& text, sdf::Root* root) {
  sdf::ParserConfig config = sdf::ParserConfig::GlobalConfig();
  config.SetWarningsPolicy(sdf::EnforcementPolicy::ERR);
  config.SetUnrecognizedElementsPolicy(sdf::EnforcementPolicy::ERR);
  config.SetDeprecatedElementsPolicy(sdf::EnforcementPolicy::ERR);
  for (const sdf::Error& error : root->LoadSdfString(text, config)) {
    ADD_FAILURE() << error.Message();
  }
}

model::Pose ToPose(const ignition::math::Pose3d& X) {
  return Eigen::Translation3d(X.Pos().X(), X.Pos().Y(), X.Pos().Z()) *
         Eigen::Quaterniond(X.Rot().W(), X.Rot().X(), X.Rot().Y(), X.Rot().Z());
}

// SDF's poses are those at the start values, so random values are start values here.
TEST(Sdf, LibsdformatPlacesEveryLinkWhereTheModelDoes) {
  std::mt19937 random(3);
  for (ExportCase& robot : test::ExportCases(4)) {
    SCOPED_TRACE(robot.name);
    const model::JointValues q = test::RandomValues(robot, random);
    for (size_t m = 0; m < q.size(); ++m) robot.robot.modules[m].start = q[m];
    sdf::Root root;
    ParseStrictly(ToSdf(robot.model, TreeOf(robot.model, robot.robot), {"robot", ""}).text, &root);
    ASSERT_NE(root.Model(), nullptr);
    const model::KinematicState state = model::ForwardKinematics(robot.model, robot.robot, q);
    for (size_t m = 0; m < state.X_RL.size(); ++m) {
      for (size_t l = 0; l < state.X_RL[m].size(); ++l) {
        const sdf::Link* link = root.Model()->LinkByName(LinkName(robot, m, l));
        ASSERT_NE(link, nullptr);
        ignition::math::Pose3d X;
        ASSERT_TRUE(link->SemanticPose().Resolve(X, "__model__").empty());
        EXPECT_LT((ToPose(X).matrix() - state.X_RL[m][l].matrix()).norm(), 1e-9);
      }
    }
  }
}

TEST(Sdf, LooksAreVisualsInTheirColoursAndTheHullCollides) {
  const ExportCase robot = test::LookingRobot();
  sdf::Root root;
  ParseStrictly(ToSdf(robot.model, TreeOf(robot.model, robot.robot), {"robot", ""}).text, &root);
  ASSERT_NE(root.Model(), nullptr);
  const sdf::Link* arm = root.Model()->LinkByName("m.arm");
  ASSERT_NE(arm, nullptr);
  ASSERT_EQ(arm->VisualCount(), 2u);
  ASSERT_EQ(arm->CollisionCount(), 1u);
  const auto uri_of = [](const sdf::Geometry* geometry) {
    return geometry->MeshShape() != nullptr ? geometry->MeshShape()->Uri() : "no mesh";
  };
  EXPECT_EQ(uri_of(arm->VisualByIndex(0)->Geom()), "robot_meshes/A.arm.look1.stl");
  EXPECT_EQ(uri_of(arm->VisualByIndex(1)->Geom()), "robot_meshes/A.arm.look2.stl");
  EXPECT_EQ(uri_of(arm->CollisionByIndex(0)->Geom()), "robot_meshes/A.arm.stl");
  const sdf::Material* material = arm->VisualByIndex(0)->Material();
  ASSERT_NE(material, nullptr);
  EXPECT_EQ(material->Diffuse(), ignition::math::Color(1.0F, 0.5F, 0.0F));
  EXPECT_EQ(arm->VisualByIndex(1)->Material(), nullptr) << "in whatever colour Gazebo gives it";
  const sdf::Link* base = root.Model()->LinkByName("m.base");
  ASSERT_NE(base, nullptr);
  EXPECT_EQ(base->VisualCount(), 1u);
  EXPECT_EQ(uri_of(base->VisualByIndex(0)->Geom()), "robot_meshes/A.base.stl");
}

TEST(Sdf, AxesLimitsAndLoopsAreThoseOfTheModel) {
  std::mt19937 random(4);
  for (ExportCase& robot : test::ExportCases(2)) {
    SCOPED_TRACE(robot.name);
    const model::JointValues q = test::RandomValues(robot, random);
    for (size_t m = 0; m < q.size(); ++m) robot.robot.modules[m].start = q[m];
    const RobotTree tree = TreeOf(robot.model, robot.robot);
    sdf::Root root;
    ParseStrictly(ToSdf(robot.model, tree, {"robot", ""}).text, &root);
    ASSERT_NE(root.Model(), nullptr);
    const model::KinematicState state = model::ForwardKinematics(robot.model, robot.robot, q);
    size_t joints = robot.robot.dockings.size();
    for (size_t m = 0; m < q.size(); ++m) {
      const model::ModuleType& type = robot.model.TypeOf(robot.robot, static_cast<int>(m));
      joints += type.joints.size();
      for (size_t j = 0; j < type.joints.size(); ++j) {
        const model::Joint& joint = type.joints[j];
        if (joint.type == model::JointType::kFixed) continue;
        const sdf::Joint* actual =
            root.Model()->JointByName(robot.robot.modules[m].name + "." + joint.name);
        ASSERT_NE(actual, nullptr);
        // The axis in the model frame is A's, reversed where the SDF joint runs from A to B.
        const bool turned =
            actual->ChildLinkName() == LinkName(robot, m, static_cast<size_t>(joint.link_b));
        ignition::math::Vector3d axis;
        ASSERT_TRUE(actual->Axis()->ResolveXyz(axis, "__model__").empty());
        const Eigen::Vector3d expected = state.X_RL[m][static_cast<size_t>(joint.link_a)].linear() *
                                         joint.axis * (turned ? -1.0 : 1.0);
        // The closing joint of an open loop has no one direction.
        const bool closes =
            std::any_of(tree.loops.begin(), tree.loops.end(),
                        [&](const TreeLoop& loop) { return loop.name == actual->Name(); });
        if (!closes) {
          EXPECT_LT((Eigen::Vector3d(axis.X(), axis.Y(), axis.Z()) - expected).norm(), 1e-9);
        }
        EXPECT_NEAR(actual->Axis()->Effort(), joint.effort, 1e-12);
        EXPECT_NEAR(actual->Axis()->MaxVelocity(), joint.speed, 1e-12);
        if (joint.type == model::JointType::kContinuous) continue;
        EXPECT_NEAR(actual->Axis()->Lower(), joint.lower - q[m][j], 1e-12);
        EXPECT_NEAR(actual->Axis()->Upper(), joint.upper - q[m][j], 1e-12);
      }
    }
    EXPECT_EQ(root.Model()->JointCount(), joints);
  }
}

TEST(Sdf, ReservedNamesAreChangedAndReported) {
  const ExportCase robot = test::CompiledModule(test::kAwkwardNames, "world");
  const Exported exported = ToSdf(robot.model, TreeOf(robot.model, robot.robot), {"robot", ""});
  const std::vector<std::string> expected = {
      "SDF keeps the name world for itself: the link is called world_ there",
      "SDF keeps the name __b__ for itself: the link is called m3l__b__ there",
      "SDF keeps the name __j__ for itself: the joint is called m3l__j__ there",
      "SDF keeps the name world for itself: the model is called m3lworld there"};
  EXPECT_EQ(exported.warnings, expected);
  sdf::Root root;
  ParseStrictly(exported.text, &root);
  ASSERT_NE(root.Model(), nullptr);
  for (const char* link : {"world_", "floor", "m3l__b__", "robot_frame"}) {
    EXPECT_TRUE(root.Model()->LinkNameExists(link)) << link;
  }
  EXPECT_TRUE(root.Model()->JointNameExists("m3l__j__"));
}

TEST(Sdf, ObstaclesStandInAWorldWithTheRobot) {
  const ExportCase robot = test::CompiledCase(test::TextOf("models/mtran.m3l"), "quadruped");
  const RobotTree tree = TreeOf(robot.model, robot.robot);
  // Each shape once, and names that SDFormat or the robot have already.
  std::vector<world::Obstacle> obstacles(4);
  obstacles[0] = {"quadruped", world::Shape::kBox};
  obstacles[1] = {"world", world::Shape::kCylinder};
  obstacles[2] = {"a ball", world::Shape::kSphere};
  obstacles[3] = {"a ball", world::Shape::kPlane};
  for (size_t i = 0; i < 4; ++i) {
    obstacles[i].size = {0.5, 0.25, 0.125};
    obstacles[i].X_WO = Eigen::Translation3d(1, 2, 3) *
                        Eigen::AngleAxisd(0.3 * static_cast<double>(i), Eigen::Vector3d::UnitX());
  }
  obstacles[1].friction = 0.25;
  sdf::Root root;
  ParseStrictly(ToSdf(robot.model, tree, {"robot", ""}, obstacles).text, &root);
  ASSERT_EQ(root.WorldCount(), 1u);
  const sdf::World& world = *root.WorldByIndex(0);
  ASSERT_NE(world.ModelByName("quadruped"), nullptr);
  EXPECT_EQ(world.ModelByName("quadruped")->LinkCount(), tree.links.size());
  const sdf::GeometryType shapes[] = {sdf::GeometryType::BOX, sdf::GeometryType::CYLINDER,
                                      sdf::GeometryType::SPHERE, sdf::GeometryType::PLANE};
  const char* const names[] = {"quadruped_", "world_", "a_ball", "a_ball_"};
  for (size_t i = 0; i < 4; ++i) {
    SCOPED_TRACE(names[i]);
    const sdf::Model* obstacle = world.ModelByName(names[i]);
    ASSERT_NE(obstacle, nullptr);
    EXPECT_TRUE(obstacle->Static());
    // Up is z there: the quarter turn that the robot is turned by.
    EXPECT_LT(
        (ToPose(obstacle->RawPose()).matrix() - (RobotFrameInZUp() * obstacles[i].X_WO).matrix())
            .norm(),
        1e-9);
    const sdf::Collision* collision = obstacle->LinkByIndex(0)->CollisionByIndex(0);
    EXPECT_EQ(collision->Geom()->Type(), shapes[i]);
  }
  const sdf::Link* post = world.ModelByName("world_")->LinkByIndex(0);
  const sdf::ElementPtr surface = post->CollisionByIndex(0)->Element()->GetElement("surface");
  EXPECT_EQ(surface->GetElement("friction")->GetElement("ode")->Get<double>("mu"), 0.25);
  EXPECT_EQ(post->CollisionByIndex(0)->Geom()->CylinderShape()->Radius(), 0.5);
  EXPECT_EQ(post->CollisionByIndex(0)->Geom()->CylinderShape()->Length(), 0.25);
}

TEST(Sdf, AnObstacleOfTrianglesIsAMeshFileBesideTheWorld) {
  const ExportCase robot = test::CompiledCase(test::TextOf("models/mtran.m3l"), "quadruped");
  std::vector<world::Obstacle> obstacles = {{"slope", world::Shape::kMesh}};
  obstacles[0].mesh = std::make_shared<const world::TriangleMesh>(
      world::TriangleMesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0.5}}, {{0, 1, 2}, {1, 3, 2}}});
  const Exported exported =
      ToSdf(robot.model, TreeOf(robot.model, robot.robot), {"robot", ""}, obstacles);
  sdf::Root root;
  ParseStrictly(exported.text, &root);
  const sdf::Model* slope = root.WorldByIndex(0)->ModelByName("slope");
  ASSERT_NE(slope, nullptr);
  const sdf::Geometry* geometry = slope->LinkByIndex(0)->CollisionByIndex(0)->Geom();
  ASSERT_EQ(geometry->Type(), sdf::GeometryType::MESH);
  EXPECT_EQ(geometry->MeshShape()->Uri(), "robot_meshes/obstacle-1.stl");
  EXPECT_EQ(exported.companions.back().path, "robot_meshes/obstacle-1.stl");
  EXPECT_EQ(exported.companions.back().bytes.size(), 84U + 2 * 50);
}

// Gazebo reads URDF by libsdformat, which melts fixed links together: what was cut comes back.
TEST(UrdfInGazebo, ACutJointComesBackInItsPlace) {
  int joints = 0;
  for (const ExportCase& robot : test::ExportCases(0)) {
    if (robot.name != "quadruped" && robot.name != "equivalent") continue;
    const RobotTree tree = OpenTreeOf(robot.model, robot.robot);
    sdf::Root root;
    const std::string urdf = ToUrdf(robot.model, tree, {"robot", ""}).text;
    for (const sdf::Error& error : root.LoadSdfString(urdf)) ADD_FAILURE() << error.Message();
    ASSERT_NE(root.Model(), nullptr);
    const std::vector<model::Pose> X_RL = StartPoses(tree);
    for (const TreeLoop& loop : tree.loops) {
      const sdf::Joint* joint = root.Model()->JointByName(loop.name);
      if (loop.loss == TreeLoop::Loss::kNothing) {
        EXPECT_EQ(joint, nullptr);
        continue;
      }
      ASSERT_NE(joint, nullptr) << loop.name;
      ++joints;
      const TreeJoint& cut = tree.joints[static_cast<size_t>(loop.joint)];
      const model::Pose X_WT = RobotFrameInZUp() * X_RL[static_cast<size_t>(loop.to)];
      ignition::math::Pose3d X;
      ASSERT_TRUE(joint->SemanticPose().Resolve(X, "__model__").empty());
      EXPECT_LT((ToPose(X).translation() - X_WT * cut.origin).norm(), 1e-9);
      ignition::math::Vector3d axis;
      ASSERT_TRUE(joint->Axis()->ResolveXyz(axis, "__model__").empty());
      EXPECT_LT((Eigen::Vector3d(axis.X(), axis.Y(), axis.Z()) - X_WT.linear() * cut.axis).norm(),
                1e-9);
    }
  }
  EXPECT_EQ(joints, 2);
}

TEST(UrdfInGazebo, ALoopThatIsOpenAtZeroIsNotWeldedOpen) {
  for (const ExportCase& robot : test::ExportCases(0)) {
    if (robot.name != "ckbot.m3l loop") continue;
    const RobotTree tree = OpenTreeOf(robot.model, robot.robot);
    ASSERT_EQ(tree.loops.size(), 1u);
    const std::string urdf = ToUrdf(robot.model, tree, {"robot", ""}).text;
    EXPECT_EQ(urdf.find("<gazebo>"), std::string::npos);
    EXPECT_NE(urdf.find("No joint for Gazebo closes " + tree.loops[0].name), std::string::npos);
    return;
  }
  FAIL() << "no loop of CKBot modules";
}

}  // namespace
}  // namespace morphbus::emit
