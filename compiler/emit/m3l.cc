#include "compiler/emit/m3l.h"

#include <fmt/format.h>

#include <vector>

#include "compiler/emit/numbers.h"

namespace morphbus::emit {
namespace {

/// Items in parentheses, wrapped at 100 columns, indented below the attribute's name.
std::string Listed(const std::string& name, const std::vector<std::string>& items) {
  constexpr size_t kColumns = 100;
  std::string text = "  " + name + "=(";
  const std::string indent(text.size(), ' ');
  size_t column = text.size();
  for (size_t i = 0; i < items.size(); ++i) {
    const std::string item = items[i] + (i + 1 < items.size() ? "," : ")");
    if (i > 0 && column + 1 + item.size() > kColumns) {
      text += "\n" + indent;
      column = indent.size();
    } else if (i > 0) {
      text += ' ';
      ++column;
    }
    text += item;
    column += item.size();
  }
  return text;
}

std::string Vector(const Eigen::Vector3d& v) {
  return fmt::format("({}, {}, {})", Number(v.x()), Number(v.y()), Number(v.z()));
}

}  // namespace

std::string RobotM3l(const model::Model& model, const model::Robot& robot) {
  const auto module_name = [&](int m) { return robot.modules[static_cast<size_t>(m)].name; };
  std::vector<std::string> modules;
  std::vector<std::string> joints;
  for (const model::ModuleInstance& module : robot.modules) {
    const model::ModuleType& type = model.module_types[static_cast<size_t>(module.type)];
    modules.push_back(type.name + " " + module.name);
    for (size_t j = 0; j < type.joints.size(); ++j) {
      if (module.start[j] == 0.0) continue;
      const bool slide = type.joints[j].type == model::JointType::kPrismatic;
      joints.push_back(fmt::format("{}.{}={}", module.name, type.joints[j].name,
                                   Number(module.start[j] / (slide ? type.unit_m : 1.0))));
    }
  }
  std::vector<std::string> connections;
  for (const model::Docking& d : robot.dockings) {
    const model::ConnectionType& connection =
        model.connection_types[static_cast<size_t>(d.connection_type)];
    const auto end = [&](int module, int connector) {
      const model::ModuleType& type = model.TypeOf(robot, module);
      return module_name(module) + "." + type.connectors[static_cast<size_t>(connector)].name;
    };
    // The name is needed where several connections could be meant.
    const std::string name = model.connection_types.size() > 1 ? connection.name + ":" : "";
    connections.push_back(fmt::format("({},{},{}{})", end(d.module_a, d.connector_a),
                                      end(d.module_b, d.connector_b), name,
                                      connection.options[static_cast<size_t>(d.option)].number));
  }
  const model::ModuleType& root = model.TypeOf(robot, robot.root_module);
  std::vector<std::string> frame;
  for (int i = 0; i < 3; ++i) {
    frame.push_back(fmt::format(
        "{}.{}.(axis: origin={}, direction={})", module_name(robot.root_module),
        root.links[static_cast<size_t>(robot.root_link)].name,
        Vector(robot.X_LR.translation() / root.unit_m), Vector(robot.X_LR.linear().col(i))));
  }
  std::string text = "robot " + robot.name + ":\n" + Listed("modules", modules) + ",\n";
  if (!connections.empty()) text += Listed("connections", connections) + ",\n";
  text += Listed("frame", frame);
  if (!joints.empty()) text += ",\n" + Listed("joints", joints);
  return text + "\n";
}

}  // namespace morphbus::emit
