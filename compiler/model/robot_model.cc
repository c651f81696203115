#include "compiler/model/robot_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "compiler/base/check.h"

namespace morphbus::model {
namespace {

/// The index of the item called `name`, if there is one.
template <typename T>
std::optional<int> FindByName(const std::vector<T>& items, const std::string& name) {
  // The first of that name is taken; the checker has seen to it that there is no second.
  for (size_t i = 0; i < items.size(); ++i) {
    if (items[i].name == name) return static_cast<int>(i);
  }
  return std::nullopt;
}

}  // namespace

std::optional<JointType> JointTypeNamed(std::string_view name) {
  const auto* const found = std::ranges::find(kJointTypeNames, name);
  if (found == std::end(kJointTypeNames)) return std::nullopt;
  // The names stand in the order of the enumerators.
  return static_cast<JointType>(found - std::begin(kJointTypeNames));
}

std::optional<SensorType> SensorTypeNamed(std::string_view name) {
  // As for joints: a word stands at the place of its enumerator.
  const auto* const found = std::ranges::find(kSensorTypeNames, name);
  if (found == std::end(kSensorTypeNames)) return std::nullopt;
  return static_cast<SensorType>(found - std::begin(kSensorTypeNames));
}

// Adding zero turns a negative zero into a plain one.
std::string NumberText(double value) { return fmt::format("{:.9g}", value + 0.0); }

std::string ValueText(const AttributeValue& value) {
  if (const bool* b = std::get_if<bool>(&value)) return *b ? "true" : "false";
  if (const double* d = std::get_if<double>(&value)) return NumberText(*d);
  return "\"" + std::get<std::string>(value) + "\"";
}

std::optional<int> ModuleType::FindLink(const std::string& link_name) const {
  return FindByName(links, link_name);
}

std::optional<int> ModuleType::FindJoint(const std::string& joint_name) const {
  return FindByName(joints, joint_name);
}

std::optional<int> ModuleType::FindConnector(const std::string& connector_name) const {
  return FindByName(connectors, connector_name);
}

std::optional<int> Robot::FindModule(const std::string& module_name) const {
  return FindByName(modules, module_name);
}

const Robot* Model::FindRobot(const std::string& name) const {
  const std::optional<int> index = FindByName(robots, name);
  return index ? &robots[*index] : nullptr;
}

const ModuleType& Model::TypeOf(const Robot& robot, int module) const {
  // A number beyond the robot's modules is our own mistake.
  MORPHBUS_CHECK(module >= 0 && module < static_cast<int>(robot.modules.size()));
  return module_types[robot.modules[module].type];
}

const Connector& Model::EndA(const Robot& robot, const Docking& docking) const {
  return TypeOf(robot, docking.module_a).connectors[docking.connector_a];
}

const Connector& Model::EndB(const Robot& robot, const Docking& docking) const {
  return TypeOf(robot, docking.module_b).connectors[docking.connector_b];
}

const ConnectionOption& Model::OptionOf(const Docking& docking) const {
  return connection_types[docking.connection_type].options[docking.option];
}

std::vector<std::vector<Eigen::Vector3d>> Link::Parts() const {
  // A hull of one part has no list of ends.
  if (part_ends.empty() && !hull.empty()) return {hull};
  std::vector<std::vector<Eigen::Vector3d>> parts;
  int begin = 0;
  for (const int end : part_ends) {
    parts.emplace_back(hull.begin() + begin, hull.begin() + end);
    begin = end;
  }
  return parts;
}

std::vector<VisualPart> Link::Looks() const {
  if (!visual.empty()) return visual;
  std::vector<VisualPart> looks;
  for (std::vector<Eigen::Vector3d>& part : Parts()) looks.push_back({std::move(part)});
  return looks;
}

double ExtentOf(const ModuleType& type) {
  Eigen::AlignedBox3d box;
  // Hulls, connectors and sub-points together, whatever link they are on.
  for (const Link& link : type.links) {
    for (const Eigen::Vector3d& p : link.hull) box.extend(p);
  }
  for (const Connector& connector : type.connectors) {
    box.extend(connector.p_MoCo_M);
    for (const Eigen::Vector3d& p : connector.subpoints) box.extend(p);
  }
  return box.isEmpty() ? 0.0 : box.sizes().maxCoeff();
}

std::optional<int> MirrorOption(const Model& model, const Docking& docking) {
  const ConnectionType& connection = model.connection_types[docking.connection_type];
  // Member a and member b can change places only if they are of one type.
  if (connection.type_a != connection.type_b) return std::nullopt;
  const ModuleType& type = model.module_types[connection.type_a];
  // A module without size must not make the tolerance zero.
  const double tolerance = 1e-6 * std::max(ExtentOf(type), 1e-12);
  // The same mating seen from b: its connectors exchanged, its pose inverted.
  const Pose X_BA = model.OptionOf(docking).X_AB.inverse();
  for (size_t i = 0; i < connection.options.size(); ++i) {
    const ConnectionOption& option = connection.options[i];
    if (option.connector_a != docking.connector_b || option.connector_b != docking.connector_a) {
      continue;
    }
    // The pose is compared in metres and by the entries of the rotation.
    const double p_error = (option.X_AB.translation() - X_BA.translation()).norm();
    const double R_error = (option.X_AB.linear() - X_BA.linear()).cwiseAbs().maxCoeff();
    if (p_error <= tolerance && R_error <= 1e-6) return static_cast<int>(i);
  }
  return std::nullopt;
}

}  // namespace morphbus::model
