// morphbus check: everything that can be said about a model without running it.

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "compiler/model/forward_kinematics.h"
#include "compiler/model/kinematic_graph.h"
#include "tools/commands.h"

namespace morphbus::tools {
namespace {

void PrintModuleType(const model::ModuleType& type) {
  double mass = 0.0;
  for (const model::Link& link : type.links) mass += link.mass_kg;
  fmt::print("module {}: {}, {}, {}, {:.3g} kg\n", type.name, Plural(type.links.size(), "link"),
             Plural(type.joints.size(), "joint"), Plural(type.connectors.size(), "connector"),
             mass);
}

void PrintRobot(const model::Model& model, const model::Robot& robot) {
  const model::KinematicGraph graph = model::BuildKinematicGraph(model, robot);
  const model::KinematicState state =
      model::ForwardKinematics(model, robot, model::StartValues(robot));
  std::vector<std::string> locked;
  for (const model::GraphJoint& joint : graph.joints) {
    if (!joint.locked) continue;
    const model::ModuleInstance& module = robot.modules[static_cast<size_t>(joint.module)];
    locked.push_back(
        module.name + "." +
        model.TypeOf(robot, joint.module).joints[static_cast<size_t>(joint.joint)].name);
  }
  fmt::print(
      "robot {}: {}, {}, {}, {}, {}\n", robot.name, Plural(robot.modules.size(), "module"),
      Plural(robot.dockings.size(), "connection"),
      fmt::format("{} {}", graph.bodies.size(), graph.bodies.size() == 1 ? "body" : "bodies"),
      Plural(graph.joints.size(), "joint"), MobilityText(graph));
  if (state.num_loops > 0) {
    fmt::print("  loops close within {:.1e} m and {:.1e} degrees\n", state.closure_m,
               state.closure_rad * 180.0 / EIGEN_PI);
  }
  if (!graph.locked_computed) {
    fmt::print("  which joints are locked is not computed either\n");
  } else if (!locked.empty()) {
    fmt::print("  locked by loops: {}\n", NameSome(locked));
  }
}

int Check(const std::vector<std::string>& files) {
  const std::optional<model::Model> model = LoadModel(files);
  if (!model) return kUnusable;
  for (const model::ModuleType& type : model->module_types) PrintModuleType(type);
  for (const model::ConnectionType& connection : model->connection_types) {
    const auto& types = model->module_types;
    fmt::print("connection {} ({}, {}): {} of {} candidates\n", connection.name,
               types[static_cast<size_t>(connection.type_a)].name,
               types[static_cast<size_t>(connection.type_b)].name, connection.options.size(),
               connection.candidates);
  }
  for (const model::Robot& robot : model->robots) PrintRobot(*model, robot);
  return kDone;
}

}  // namespace

void AddCheck(CLI::App& app, Action* action) {
  CLI::App* sub = app.add_subcommand("check", "Check M3L models and print what they hold");
  auto files = std::make_shared<std::vector<std::string>>();
  sub->add_option("FILE", *files, "M3L files; several are one model")->required();
  sub->footer("Example:\n  morphbus check models/mtran.m3l");
  sub->callback([files, action] { *action = [files] { return Check(*files); }; });
}

}  // namespace morphbus::tools
