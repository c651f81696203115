#include "compiler/emit/back_ends.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

#include "compiler/emit/numbers.h"

namespace morphbus::emit {
namespace {

std::string Vector(const Eigen::Vector3d& v) {
  return fmt::format("({}, {}, {})", Number(v.x()), Number(v.y()), Number(v.z()));
}

}  // namespace

std::string RobotM3l(const model::Model& model, const model::Robot& robot) {
  // Modules, and the joints that do not start at 0, in the units of their types.
  const auto module_name = [&](int m) { return robot.modules[m].name; };
  std::vector<std::string> modules;
  std::vector<std::string> joints;
  for (const model::ModuleInstance& module : robot.modules) {
    const model::ModuleType& type = model.module_types[module.type];
    modules.push_back(type.name + " " + module.name);
    for (size_t j = 0; j < type.joints.size(); ++j) {
      if (module.start[j] == 0.0) continue;
      const bool slide = type.joints[j].type == model::JointType::kPrismatic;
      joints.push_back(fmt::format("{}.{}={}", module.name, type.joints[j].name,
                                   Number(module.start[j] / (slide ? type.unit_m : 1.0))));
    }
  }
  // Connections by the numbers that the solver gave them.
  std::vector<std::string> connections;
  for (const model::Docking& d : robot.dockings) {
    const model::ConnectionType& connection = model.connection_types[d.connection_type];
    const auto end = [&](int module, int connector) {
      const model::ModuleType& type = model.TypeOf(robot, module);
      return module_name(module) + "." + type.connectors[connector].name;
    };
    // The name is needed where several connections could be meant.
    const std::string name = model.connection_types.size() > 1 ? connection.name + ":" : "";
    connections.push_back(fmt::format("({},{},{}{})", end(d.module_a, d.connector_a),
                                      end(d.module_b, d.connector_b), name,
                                      connection.options[d.option].number));
  }
  // The frame by three axes of the link that carries it: its origin and the directions north, up
  // and east.
  const model::ModuleType& root = model.TypeOf(robot, robot.root_module);
  std::vector<std::string> frame;
  for (int i = 0; i < 3; ++i) {
    frame.push_back(fmt::format("{}.{}.(axis: origin={}, direction={})",
                                module_name(robot.root_module), root.links[robot.root_link].name,
                                Vector(robot.X_LR.translation() / root.unit_m),
                                Vector(robot.X_LR.linear().col(i))));
  }
  // The parts of the statement in the order in which M3L declares them.
  const auto list = [](const std::vector<std::string>& items) {
    return fmt::format("({})", fmt::join(items, ", "));
  };
  std::string text = fmt::format("robot {}: modules={}", robot.name, list(modules));
  if (!connections.empty()) text += ", connections=" + list(connections);
  text += ", frame=" + list(frame);
  if (!joints.empty()) text += ", joints=" + list(joints);
  return text + "\n";
}

}  // namespace morphbus::emit
