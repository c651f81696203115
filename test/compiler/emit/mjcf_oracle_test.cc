// Exported MJCF as MuJoCo loads it: link poses, masses, and loops that close where ours do.

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <random>

#include "compiler/emit/back_ends.h"
#include "test/compiler/emit/exported_robots.h"
#include "test/compiler/emit/mujoco_robot.h"
#include "test/compiler/solver/known_modules.h"
#include "test/support/compiled.h"

namespace morphbus::emit {
namespace {

using test::ExportCase;

using test::Position;
using test::Residual;
using test::Simulation;

Simulation Load(const ExportCase& robot) {
  return test::LoadInMuJoCo(ToMjcf(robot.model, TreeOf(robot.model, robot.robot), "robot"));
}

/// Joints that no tree joint moves are set too: they are the ones that close loops.
void SetValues(const ExportCase& robot, const model::JointValues& q, const Simulation& simulation) {
  for (size_t m = 0; m < q.size(); ++m) {
    const model::ModuleType& type = robot.model.TypeOf(robot.robot, static_cast<int>(m));
    for (size_t j = 0; j < q[m].size(); ++j) {
      if (type.joints[j].type == model::JointType::kFixed) continue;
      Position(simulation, robot.robot.modules[m].name + "." + type.joints[j].name) = q[m][j];
    }
  }
}

void ExpectSamePoses(const ExportCase& robot, const model::JointValues& q,
                     const Simulation& simulation) {
  SetValues(robot, q, simulation);
  mj_forward(simulation.model.get(), simulation.data.get());
  const model::KinematicState state = model::ForwardKinematics(robot.model, robot.robot, q);
  for (size_t m = 0; m < state.X_RL.size(); ++m) {
    for (size_t l = 0; l < state.X_RL[m].size(); ++l) {
      const std::string name = LinkName(robot, m, l);
      const int body = mj_name2id(simulation.model.get(), mjOBJ_BODY, name.c_str());
      ASSERT_GE(body, 0) << name;
      using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
      const Eigen::Map<const Eigen::Vector3d> p(simulation.data->xpos + 3 * body);
      const Eigen::Map<const RowMajor> R(simulation.data->xmat + 9 * body);
      const model::Pose X_WL = RobotFrameInZUp() * state.X_RL[m][l];
      EXPECT_LT((p - X_WL.translation()).norm(), 1e-9) << name;
      EXPECT_LT((R - X_WL.linear()).norm(), 1e-9) << name;
    }
  }
}

TEST(Mjcf, MuJoCoPlacesEveryLinkWhereTheModelDoes) {
  std::mt19937 random(2);
  for (const ExportCase& robot : test::ExportCases(20)) {
    SCOPED_TRACE(robot.name);
    const Simulation simulation = Load(robot);
    ASSERT_NE(simulation.model, nullptr);
    for (int round = 0; round < 3; ++round) {
      ExpectSamePoses(robot, test::RandomValues(robot, random), simulation);
    }
  }
}

TEST(Mjcf, LoopsOfTheModelsCloseAtTheStart) {
  for (const ExportCase& robot : test::ExportCases(0)) {
    if (robot.name == "gadgets") continue;  // Its loop does not close at its start values.
    SCOPED_TRACE(robot.name);
    const RobotTree tree = TreeOf(robot.model, robot.robot);
    const Simulation simulation = Load(robot);
    ASSERT_NE(simulation.model, nullptr);
    EXPECT_EQ(simulation.model->neq, static_cast<int>(tree.loops.size()));
    mj_resetDataKeyframe(simulation.model.get(), simulation.data.get(), 0);
    mj_forward(simulation.model.get(), simulation.data.get());
    EXPECT_LT(Residual(simulation), 1e-6);
  }
}

TEST(Mjcf, LoopsOpenWhereAJointMovesAlone) {
  for (const ExportCase& robot : test::ExportCases(0)) {
    if (robot.name != "quadruped" && robot.name != "equivalent") continue;
    const Simulation simulation = Load(robot);
    ASSERT_NE(simulation.model, nullptr);
    EXPECT_EQ(simulation.model->neq, 2);
    ASSERT_EQ(simulation.model->nkey, 1);
    mj_resetDataKeyframe(simulation.model.get(), simulation.data.get(), 0);
    mj_forward(simulation.model.get(), simulation.data.get());
    EXPECT_LT(Residual(simulation), 1e-9);
    Position(simulation, "m5.joint_1") += 0.1;
    mj_forward(simulation.model.get(), simulation.data.get());
    EXPECT_GT(Residual(simulation), 1e-3);
  }
}

// The joint that closes a loop inside a module keeps its own freedom: the loop is closed wherever
// the tree's joints and that joint agree.
TEST(Mjcf, AJointThatClosesALoopStillMoves) {
  const model::Model model = test::GadgetModel();
  model::Robot one = ModuleAsRobot(model, 0);
  one.modules[0].name = "g";
  const RobotTree tree = TreeOf(model, one);
  ASSERT_EQ(tree.loops.size(), 1u);
  const std::string& closing = tree.loops[0].name;
  const Simulation simulation = test::LoadInMuJoCo(ToMjcf(model, tree, "gadget"));
  ASSERT_NE(simulation.model, nullptr);
  mj_forward(simulation.model.get(), simulation.data.get());
  EXPECT_LT(Residual(simulation), 1e-9);
  Position(simulation, closing) = 0.4;
  mj_forward(simulation.model.get(), simulation.data.get());
  EXPECT_GT(Residual(simulation), 1e-3);
  // The poses of the two links that it joins, by MuJoCo, differ by just that motion.
  const auto& loop = tree.loops[0];
  const int body = mj_name2id(simulation.model.get(), mjOBJ_BODY, (closing + ".loop").c_str());
  ASSERT_GE(body, 0);
  const Eigen::Map<const Eigen::Vector3d> p(simulation.data->xpos + 3 * body);
  const model::Pose X = RobotFrameInZUp() * StartPoses(tree)[static_cast<size_t>(loop.from)] *
                        MotionOf(tree.joints[static_cast<size_t>(loop.joint)], 0.4);
  EXPECT_LT((p - X.translation()).norm(), 1e-9);
}

TEST(Mjcf, LooksAreSeenInTheirColoursAndTouchNothing) {
  const ExportCase robot = test::LookingRobot();
  const Simulation simulation = Load(robot);
  ASSERT_NE(simulation.model, nullptr);
  const mjModel& loaded = *simulation.model;
  const int arm = mj_name2id(&loaded, mjOBJ_BODY, "m.arm");
  ASSERT_GE(arm, 0);
  int seen = 0, solid = 0, dented = 0;
  for (int g = loaded.body_geomadr[arm]; g < loaded.body_geomadr[arm] + loaded.body_geomnum[arm];
       ++g) {
    const bool touches = loaded.geom_contype[g] != 0 || loaded.geom_conaffinity[g] != 0;
    // Viewers show the groups below 3 unless they are told otherwise.
    EXPECT_NE(touches, loaded.geom_group[g] < 3) << g;
    (touches ? solid : seen) += 1;
    const float* color = loaded.geom_rgba + 4 * g;
    if (color[0] != 1.0F || color[1] != 0.5F || color[2] != 0.0F) continue;
    ++dented;
    EXPECT_EQ(loaded.mesh_facenum[loaded.geom_dataid[g]], 6) << "as it is, with its dent";
    EXPECT_EQ(loaded.mesh_vertnum[loaded.geom_dataid[g]], 5);
  }
  EXPECT_EQ(seen, 2);
  EXPECT_EQ(solid, 1);
  EXPECT_EQ(dented, 1);
  // The base looks like its hull: one shape, which is seen and touches.
  const int base = mj_name2id(&loaded, mjOBJ_BODY, "m.base");
  ASSERT_EQ(loaded.body_geomnum[base], 1);
  EXPECT_NE(loaded.geom_contype[loaded.body_geomadr[base]], 0);
  EXPECT_LT(loaded.geom_group[loaded.body_geomadr[base]], 3);
  EXPECT_NEAR(loaded.body_mass[arm], loaded.body_mass[base], 1e-9) << "looks weigh nothing";
}

// MuJoCo's XML reader takes 100 nested elements.
TEST(Mjcf, AChainOfAHundredModulesIsRead) {
  ExportCase robot{"chain", test::MtranModel(), {}};
  robot.robot.name = "chain";
  const int option = 16;  // The default of c5 and c2, number 17.
  const model::ConnectionOption& along = robot.model.connection_types[0].options[option];
  for (int m = 0; m < 100; ++m) {
    robot.robot.modules.push_back({"m" + std::to_string(m), 0, {0.01, 0.0}});
    if (m > 0) {
      robot.robot.dockings.push_back({m - 1, along.connector_a, m, along.connector_b, 0, option});
    }
  }
  const Exported exported = ToMjcf(robot.model, TreeOf(robot.model, robot.robot), "robot");
  EXPECT_GT(exported.companions.size(), 2u);
  size_t bytes = exported.text.size();
  for (const CompanionFile& part : exported.companions) bytes += part.bytes.size();
  EXPECT_LT(bytes, 500000u);
  const Simulation simulation = test::LoadInMuJoCo(exported);
  ASSERT_NE(simulation.model, nullptr);
  std::mt19937 random(6);
  ExpectSamePoses(robot, test::RandomValues(robot, random), simulation);
  test::GoToStart(simulation);
  EXPECT_EQ(Position(simulation, "m99.joint_1"), 0.01);
}

// Not tried on MuJoCo, which takes a minute to compile so large a model.
TEST(Mjcf, AKeyframeLongerThanMuJoCoReadsIsLeftOutAndReported) {
  const model::Model model = test::MtranModel();
  RobotTree tree = TreeOf(model, ModuleAsRobot(model, 0));
  // More bars on the root, until qpos has 1000 values: 7 are the free joint's.
  while (tree.joints.size() + 7 < 1000) {
    tree.links.push_back(tree.links[1]);
    tree.links.back().name = "link_" + std::to_string(tree.links.size());
    tree.links.back().joint = static_cast<int>(tree.joints.size());
    tree.joints.push_back(tree.joints[0]);
    tree.joints.back().name = "joint_" + std::to_string(tree.joints.size());
  }
  const Exported longest = ToMjcf(model, tree, "heap");
  EXPECT_TRUE(longest.warnings.empty());
  EXPECT_NE(longest.text.find("<keyframe>"), std::string::npos);
  tree.links.push_back(tree.links.back());
  tree.links.back().name = "one_more";
  tree.links.back().joint = static_cast<int>(tree.joints.size());
  tree.joints.push_back(tree.joints[0]);
  tree.joints.back().name = "one_more";
  const Exported longer = ToMjcf(model, tree, "heap");
  ASSERT_EQ(longer.warnings.size(), 1u);
  EXPECT_NE(longer.warnings[0].find("at most 1000 values, this robot has 1001"), std::string::npos);
  EXPECT_EQ(longer.text.find("<keyframe>"), std::string::npos);
}

TEST(Mjcf, OurNamesGiveWayAndReservedOnesAreReported) {
  const ExportCase robot = test::CompiledModule(test::kAwkwardNames, "world");
  const Exported exported = ToMjcf(robot.model, TreeOf(robot.model, robot.robot), "robot");
  ASSERT_EQ(exported.warnings.size(), 1u);
  EXPECT_EQ(exported.warnings[0],
            "MJCF keeps the name world for itself: the link is called world_ there");
  const Simulation simulation = test::LoadInMuJoCo(exported);
  ASSERT_NE(simulation.model, nullptr);
  for (const char* body : {"world_", "floor", "__b__", "robot_frame", "robot_frame_"}) {
    EXPECT_GT(mj_name2id(simulation.model.get(), mjOBJ_BODY, body), 0) << body;
  }
  for (const char* geom : {"world_", "floor", "__b__", "robot_frame", "floor_"}) {
    EXPECT_GE(mj_name2id(simulation.model.get(), mjOBJ_GEOM, geom), 0) << geom;
  }
}

// The URDF, which MuJoCo reads too, with its meshes where they were exported to.
TEST(UrdfInMuJoCo, EveryLinkIsThereWhereTheModelPlacesIt) {
  for (const ExportCase& robot : test::ExportCases(1)) {
    if (robot.name == "gadgets") continue;  // Its loop does not close at its start values.
    SCOPED_TRACE(robot.name);
    const RobotTree tree = OpenTreeOf(robot.model, robot.robot);
    const Exported urdf = ToUrdf(robot.model, tree, {"robot", ""});
    const Simulation simulation = test::LoadInMuJoCo(urdf, "robot.urdf");
    ASSERT_NE(simulation.model, nullptr);
    for (const TreeJoint& joint : tree.joints) {
      if (joint.child < 0 || joint.type == model::JointType::kFixed) continue;
      Position(simulation, joint.name) = joint.start;
    }
    mj_forward(simulation.model.get(), simulation.data.get());
    const std::vector<model::Pose> X_RL = StartPoses(tree);
    for (size_t i = 0; i < tree.links.size(); ++i) {
      const int body = mj_name2id(simulation.model.get(), mjOBJ_BODY, tree.links[i].name.c_str());
      ASSERT_GE(body, 0) << tree.links[i].name;
      const Eigen::Map<const Eigen::Vector3d> p(simulation.data->xpos + 3 * body);
      EXPECT_LT((p - (RobotFrameInZUp() * X_RL[i]).translation()).norm(), 1e-9);
    }
  }
}

TEST(UrdfInMuJoCo, ALinkCalledWorldIsNotTheWorld) {
  const ExportCase robot = test::CompiledModule(test::kAwkwardNames, "world");
  const Exported urdf = ToUrdf(robot.model, OpenTreeOf(robot.model, robot.robot), {"robot", ""});
  ASSERT_EQ(urdf.warnings.size(), 1u);
  EXPECT_EQ(urdf.warnings[0],
            "URDF keeps the name world for itself: the link is called world_ there");
  const Simulation simulation = test::LoadInMuJoCo(urdf, "robot.urdf");
  ASSERT_NE(simulation.model, nullptr);
  for (const char* body : {"world_", "floor", "__b__", "robot_frame", "robot_frame_"}) {
    EXPECT_GT(mj_name2id(simulation.model.get(), mjOBJ_BODY, body), 0) << body;
  }
}

TEST(Mjcf, TheRobotHasItsMassAndStandsOnTheFloor) {
  for (const ExportCase& robot : test::ExportCases(0)) {
    if (robot.name != "quadruped" && robot.name != "equivalent") continue;
    const RobotTree tree = TreeOf(robot.model, robot.robot);
    const Simulation simulation = Load(robot);
    ASSERT_NE(simulation.model, nullptr);
    double mass = 0.0;
    for (const TreeLink& link : tree.links) {
      mass += model::ComputeLinkMass(robot.model.module_types[0], link.link).mass_kg;
    }
    EXPECT_NEAR(mj_getTotalmass(simulation.model.get()), mass, 1e-9);
    mj_resetDataKeyframe(simulation.model.get(), simulation.data.get(), 0);
    for (int step = 0; step < 500; ++step) mj_step(simulation.model.get(), simulation.data.get());
    const int trunk = mj_name2id(simulation.model.get(), mjOBJ_BODY, "m5.passive_block");
    const double fallen =
        simulation.data->xpos[3 * trunk + 2] - StartPoses(tree)[0].translation().y();
    EXPECT_LT(std::abs(fallen), 0.02) << robot.name;
    EXPECT_LT(Residual(simulation), 2e-3);
  }
}

// A ball on a slope beside the robot: it does not move, and what is dropped on it meets it.
TEST(Mjcf, ObstaclesStandStillWhereTheyAre) {
  const ExportCase robot = test::CompiledCase(test::TextOf("models/mtran.m3l"), "quadruped");
  const RobotTree tree = TreeOf(robot.model, robot.robot);
  std::vector<world::Obstacle> obstacles(4);
  // "floor" is the ground's name already.
  obstacles[0] = {"floor", world::Shape::kBox};
  obstacles[1] = {"post", world::Shape::kCylinder};
  obstacles[2] = {"ball", world::Shape::kSphere};
  obstacles[3] = {"slope", world::Shape::kPlane};
  for (world::Obstacle& obstacle : obstacles) {
    obstacle.size = {0.5, 0.25, 0.125};
    obstacle.X_WO =
        Eigen::Translation3d(1, 2, 3) * Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX());
  }
  obstacles[1].friction = 0.25;
  const Simulation simulation = test::LoadInMuJoCo(ToMjcf(robot.model, tree, "robot", obstacles));
  ASSERT_NE(simulation.model, nullptr);
  const mjModel& m = *simulation.model;
  const double floor = m.geom_pos[3 * mj_name2id(&m, mjOBJ_GEOM, "floor") + 2];
  const int types[] = {mjGEOM_BOX, mjGEOM_CYLINDER, mjGEOM_SPHERE, mjGEOM_PLANE};
  const char* const names[] = {"floor_", "post", "ball", "slope"};
  for (size_t i = 0; i < 4; ++i) {
    SCOPED_TRACE(names[i]);
    const int geom = mj_name2id(&m, mjOBJ_GEOM, names[i]);
    ASSERT_GE(geom, 0);
    EXPECT_EQ(m.geom_type[geom], types[i]);
    EXPECT_EQ(m.geom_bodyid[geom], 0);
    // North stays x, up is z, and east is the other way from y.
    const double* at = &m.geom_pos[3 * geom];
    EXPECT_NEAR(at[0], 1, 1e-9);
    EXPECT_NEAR(at[1], -3, 1e-9);
    EXPECT_NEAR(at[2], 2 + floor, 1e-9);
  }
  const int post = mj_name2id(&m, mjOBJ_GEOM, "post");
  EXPECT_EQ(m.geom_friction[3 * post], 0.25);
  EXPECT_EQ(m.geom_size[3 * post], 0.5);
  EXPECT_EQ(m.geom_size[3 * post + 1], 0.125);
}

// A valley, whose hull would be a block up to the height of its sides: MuJoCo finds each point of
// both slopes, and the bottom between them.
TEST(Mjcf, AMeshIsItsTrianglesAndNotTheirHull) {
  const ExportCase robot = test::CompiledCase(test::TextOf("models/mtran.m3l"), "quadruped");
  const RobotTree tree = TreeOf(robot.model, robot.robot);
  auto valley = std::make_shared<world::TriangleMesh>();
  // Along y, with slopes of one half down to the line x = 0; outside is up, z.
  valley->points = {{-1, -1, 0.5}, {0, -1, 0}, {1, -1, 0.5}, {-1, 1, 0.5}, {0, 1, 0}, {1, 1, 0.5}};
  valley->triangles = {{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}, {0, 1, 1}};
  // Two slivers: MuJoCo has nothing to say against the one that is left, and could not read the
  // other.
  valley->points.insert(valley->points.end(),
                        {{-1, -1, 0.5}, {1, -1, 0.5}, {0, -1, 0.5 + 1e-5}, {0, -1, 0.5 + 1e-9}});
  valley->triangles.insert(valley->triangles.end(), {{6, 7, 9}, {6, 7, 8}});
  world::Obstacle obstacle{"valley", world::Shape::kMesh};
  obstacle.mesh = valley;
  obstacle.friction = 0.25;
  // Our worlds have y up.
  obstacle.X_WO = Eigen::Translation3d(5, 2, 3) *
                  Eigen::AngleAxisd(-0.5 * std::numbers::pi, Eigen::Vector3d::UnitX());
  const Simulation simulation = test::LoadInMuJoCo(ToMjcf(robot.model, tree, "robot", {obstacle}));
  ASSERT_NE(simulation.model, nullptr);
  const mjModel& m = *simulation.model;
  // A triangle without area is nothing that can be touched.
  EXPECT_GE(mj_name2id(&m, mjOBJ_GEOM, "valley/5"), 0);
  EXPECT_LT(mj_name2id(&m, mjOBJ_GEOM, "valley/6"), 0);
  EXPECT_EQ(m.geom_friction[3 * mj_name2id(&m, mjOBJ_GEOM, "valley/1")], 0.25);
  const double floor = m.geom_pos[3 * mj_name2id(&m, mjOBJ_GEOM, "floor") + 2];
  mj_forward(simulation.model.get(), simulation.data.get());
  for (const double x : {-0.9, -0.5, -0.1, -0.01, 0.01, 0.3, 0.99}) {
    for (const double y : {-0.95, -0.2, 0.7}) {
      SCOPED_TRACE(testing::Message() << x << " " << y);
      // The valley's y is north-west-up's west, where it stands at -3.
      const double from[] = {5 + x, -3 + y, 2 + floor + 1}, down[] = {0, 0, -1};
      int hit = -1;
      const double way = mj_ray(&m, simulation.data.get(), from, down, nullptr, 1, -1, &hit);
      EXPECT_NEAR(way, 1 - 0.5 * std::abs(x), 1e-6);
      ASSERT_GE(hit, 0);
      EXPECT_TRUE(std::string(mj_id2name(&m, mjOBJ_GEOM, hit)).starts_with("valley/"));
    }
  }
}

}  // namespace
}  // namespace morphbus::emit
