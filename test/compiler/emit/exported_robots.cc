#include "test/compiler/emit/exported_robots.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include <gtest/gtest.h>
#include <unistd.h>

#include "compiler/m3l/compile.h"
#include "test/compiler/solver/known_modules.h"
#include "test/support/source_dir.h"

namespace morphbus::test {
namespace {

using model::JointType;

model::Joint MakeJoint(const std::string& name, JointType type, int a, int b, const Vector3d& at,
                       const Vector3d& along) {
  model::Joint joint;
  joint.name = name;
  joint.type = type;
  joint.link_a = a;
  joint.link_b = b;
  joint.p_MoJo_M = at;
  joint.axis = along.normalized();
  joint.lower = -0.7;
  joint.upper = 1.1;
  if (type == JointType::kContinuous) {
    joint.lower = -std::numeric_limits<double>::infinity();
    joint.upper = std::numeric_limits<double>::infinity();
  }
  return joint;
}

std::vector<Vector3d> BoxAt(const Vector3d& at, double half) {
  std::vector<Vector3d> corners;
  for (int i = 0; i < 8; ++i) {
    corners.push_back(
        at + half * Vector3d((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1));
  }
  return corners;
}

/// A random tree of modules of type 0: each hangs by a random option at a free connector.
model::Robot RandomTree(const model::Model& model, std::mt19937& random) {
  const auto below = [&](size_t n) { return static_cast<int>(random() % n); };
  model::Robot robot;
  robot.name = "random";
  const int count = 2 + below(7);
  std::vector<std::array<bool, 6>> used(static_cast<size_t>(count), std::array<bool, 6>{});
  for (int m = 0; m < count; ++m) {
    robot.modules.push_back({"m" + std::to_string(m), 0, {0.1 * below(9) - 0.4, 0.2}});
  }
  for (int m = 1; m < count;) {
    const int host = below(static_cast<size_t>(m));
    const int option = below(model.connection_types[0].options.size());
    const model::ConnectionOption& o =
        model.connection_types[0].options[static_cast<size_t>(option)];
    const bool hosts_a = below(2) == 0;
    const auto at_host = static_cast<size_t>(hosts_a ? o.connector_a : o.connector_b);
    if (used[static_cast<size_t>(host)][at_host]) continue;
    used[static_cast<size_t>(host)][at_host] = true;
    used[static_cast<size_t>(m)][static_cast<size_t>(hosts_a ? o.connector_b : o.connector_a)] =
        true;
    model::Docking docking{host, o.connector_a, m, o.connector_b, 0, option};
    if (!hosts_a) std::swap(docking.module_a, docking.module_b);
    robot.dockings.push_back(docking);
    ++m;
  }
  robot.root_module = below(static_cast<size_t>(count));
  robot.root_link = below(3);
  robot.X_LR = Eigen::Translation3d(0.3, -0.2, 0.1) *
               Eigen::AngleAxisd(0.1 * below(60), Vector3d(1, 2, 3).normalized());
  return robot;
}

/// Every robot of every model that is shipped.
void AddModelFiles(std::vector<ExportCase>* cases) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(test::SourcePath("models"))) {
    if (entry.path().extension() == ".m3l") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  for (const std::filesystem::path& file : files) {
    const m3l::CompileOutput output = m3l::CompileFiles({file.string()});
    if (!output.model) {
      ADD_FAILURE() << file << " does not compile";
      continue;
    }
    for (const model::Robot& robot : output.model->robots) {
      cases->push_back({file.filename().string() + " " + robot.name, *output.model, robot});
    }
  }
}

/// The model of a text; a test that fails, and an empty model, if there is none.
model::Model CompiledModel(const std::string& m3l) {
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) /
                                     ("morphbus-" + std::to_string(::getpid()) + ".m3l");
  std::ofstream(file) << m3l;
  m3l::CompileOutput output = m3l::CompileFiles({file.string()});
  std::filesystem::remove(file);
  EXPECT_TRUE(output.model) << m3l;
  return output.model ? *output.model : model::Model();
}

}  // namespace

const char* const kAwkwardNames =
    "module world: unit=0.1\n"
    "link world: (point a: coords=(0,0,0)) (point b: coords=(0,1,0)) (point c: coords=(0,0,1))\n"
    "  (point d: coords=(0.5,0,0)) hull=convex(world.point), mass=0.1\n"
    "link floor: (point a: coords=(1,0,0)) (point b: coords=(1,1,0)) (point c: coords=(1,0,1))\n"
    "  (point d: coords=(1.5,0,0)) hull=convex(floor.point), mass=0.1\n"
    "link __b__: (point a: coords=(2,0,0)) (point b: coords=(2,1,0)) (point c: coords=(2,0,1))\n"
    "  (point d: coords=(2.5,0,0)) hull=convex(__b__.point), mass=0.1\n"
    "link robot_frame: (point a: coords=(3,0,0)) (point b: coords=(3,1,0)) (point c: "
    "coords=(3,0,1))\n"
    "  (point d: coords=(3.5,0,0)) hull=convex(robot_frame.point), mass=0.1\n"
    "axis up: origin=(0,0,0), direction=(0,0,1)\n"
    "axis down: origin=(0,0,0), direction=(0,0,-1)\n"
    "joint j: type=revolute, value=[-1,1], pair=((floor,up),(world,down))\n"
    "joint __j__: type=revolute, value=[-1,1], pair=((__b__,up),(world,down))\n"
    "joint k: type=revolute, value=[-1,1], pair=((robot_frame,up),(__b__,down))\n";

model::Model GadgetModel() {
  model::ModuleType type;
  type.name = "GADGET";
  type.links.push_back({"base", BoxAt(Vector3d::Zero(), 0.05), {}, 0.3});
  type.links.push_back({"slider", BoxAt({0.2, 0, 0}, 0.02), {}, 0.1});
  type.links.push_back({"arm", BoxAt({0, 0.2, 0}, 0.03), {}, 0.2});
  type.links.push_back({"lid", {}, {}, 0.05});
  type.links.push_back(
      {"plate", {{0, 0, 0.2}, {0.05, 0, 0.2}, {0.05, 0.04, 0.2}, {0, 0.04, 0.2}}, {}, 0.05});
  type.joints = {
      MakeJoint("slide", JointType::kPrismatic, 1, 0, {0.1, 0.02, 0}, {1, 2, -0.5}),
      MakeJoint("spin", JointType::kContinuous, 0, 2, {0.01, 0.1, -0.03}, {-0.3, 1, 0.7}),
      MakeJoint("glue", JointType::kFixed, 3, 2, {0, 0.2, 0.03}, {0, 0, 1}),
      MakeJoint("hinge", JointType::kRevolute, 4, 1, {0.1, 0, 0.1}, {0, -1, 0}),
      MakeJoint("through_origin", JointType::kRevolute, 4, 3, {0, 0, 0.15}, {0, 0, 1}),
  };
  model::Connector plug;
  plug.name = "plug";
  plug.link = 0;
  plug.p_MoCo_M = {-0.05, 0, 0};
  plug.subpoint_names = {"_1", "_2"};
  plug.subpoints = {{-0.05, 0.05, 0}, {-0.05, 0, 0.05}};
  model::Connector socket = plug;
  socket.name = "socket";
  socket.link = 4;
  socket.p_MoCo_M = {0.05, 0.02, 0.2};
  socket.subpoints = {{0.05, 0.04, 0.2}, {0.05, 0.02, 0.25}};
  type.connectors = {plug, socket};
  model::Model model;
  model.module_types.push_back(type);
  model::ConnectionType connection;
  connection.name = "SNAP";
  model::ConnectionOption option;
  option.number = 1;
  option.connector_a = 0;
  option.connector_b = 1;
  option.X_AB = Eigen::Translation3d(-0.3, 0.1, 0.2) *
                Eigen::AngleAxisd(2.1, Vector3d(0.3, -0.5, 0.8).normalized());
  connection.options.push_back(option);
  model.connection_types.push_back(connection);
  return model;
}

std::vector<ExportCase> ExportCases(int num_trees) {
  constexpr double kUnit = 0.0325;
  const model::Model mtran = MtranModel(kUnit);
  std::vector<ExportCase> cases;
  cases.push_back({"quadruped", mtran, Quadruped(mtran, kUnit)});
  cases.push_back({"equivalent", mtran, EquivalentQuadruped(mtran, kUnit)});
  for (int seed = 0; seed < num_trees; ++seed) {
    std::mt19937 random(static_cast<unsigned>(seed));
    cases.push_back({"tree " + std::to_string(seed), mtran, RandomTree(mtran, random)});
  }
  const model::Model gadget = GadgetModel();
  model::Robot two;
  two.name = "two_gadgets";
  two.modules = {{"g1", 0, {0.1, 2.0, 0.0, 0.3, -0.2}}, {"g2", 0, {0.0, 0.0, 0.0, 0.0, 0.0}}};
  two.dockings = {{0, 0, 1, 1, 0, 0}};
  two.root_link = 2;
  two.X_LR = Eigen::Translation3d(0.1, 0.2, 0.3) * Eigen::AngleAxisd(0.4, Vector3d::UnitY());
  cases.push_back({"gadgets", gadget, two});
  AddModelFiles(&cases);
  return cases;
}

ExportCase CompiledCase(const std::string& m3l, const std::string& robot) {
  ExportCase made{robot, CompiledModel(m3l), {}};
  for (const model::Robot& candidate : made.model.robots) {
    if (candidate.name == robot) made.robot = candidate;
  }
  EXPECT_EQ(made.robot.name, robot);
  return made;
}

ExportCase CompiledModule(const std::string& m3l, const std::string& type) {
  ExportCase made{type, CompiledModel(m3l), {}};
  for (size_t i = 0; i < made.model.module_types.size(); ++i) {
    if (made.model.module_types[i].name == type) {
      made.robot = emit::ModuleAsRobot(made.model, static_cast<int>(i));
    }
  }
  EXPECT_EQ(made.robot.name, type);
  return made;
}

ExportCase LookingRobot() {
  ExportCase made = CompiledCase(
      "module A: unit=0.1\n"
      "link base: hull=box(size=(1,1,1))\n"
      "link arm: hull=box(size=(1,1,1), at=(2,0,0)), visual=sphere(radius=.5, at=(2,0,0))\n"
      "axis z: origin=(1,0,0), direction=(0,0,1)\n"
      "axis y: origin=(1,0,0), direction=(0,0,-1)\n"
      "joint j: type=revolute, value=[-1,1], pair=((arm,z),(base,y))\n"
      "robot r: modules=(A m)\n",
      "r");
  // The fifth corner lies inside the others.
  model::VisualPart dented;
  dented.points = {{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}, {0.01, 0.01, 0.01}};
  dented.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 4}, {2, 3, 4}, {3, 1, 4}};
  dented.color = Color{1.0, 0.5, 0.0};
  std::vector<model::VisualPart>& looks = made.model.module_types[0].links[1].visual;
  looks.insert(looks.begin(), dented);
  return made;
}

model::JointValues RandomValues(const ExportCase& robot, std::mt19937& random) {
  model::JointValues q = model::StartValues(robot.robot);
  for (size_t m = 0; m < q.size(); ++m) {
    const model::ModuleType& type = robot.model.TypeOf(robot.robot, static_cast<int>(m));
    for (size_t j = 0; j < q[m].size(); ++j) {
      const model::Joint& joint = type.joints[j];
      std::uniform_real_distribution<double> value(std::max(joint.lower, -3.0),
                                                   std::min(joint.upper, 3.0));
      q[m][j] = joint.type == JointType::kFixed ? 0.0 : value(random);
    }
  }
  return q;
}

std::string LinkName(const ExportCase& robot, size_t module, size_t link) {
  return robot.robot.modules[module].name + "." +
         robot.model.TypeOf(robot.robot, static_cast<int>(module)).links[link].name;
}

}  // namespace morphbus::test
