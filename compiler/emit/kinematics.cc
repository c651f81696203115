#include "compiler/emit/kinematics.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "compiler/base/check.h"
#include "compiler/emit/numbers.h"

namespace morphbus::emit {
namespace {

// The virtual machine computes in single precision.
vm::Vec3 ToVm(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

vm::PoseF ToVm(const model::Pose& X) {
  // Of the two quaternions of a rotation always the same, so that images are canonical.
  const Eigen::Quaterniond q = Canonical(X.linear());
  vm::PoseF pose;
  pose.p = ToVm(Eigen::Vector3d(X.translation()));
  pose.q = {static_cast<float>(q.w()), static_cast<float>(q.x()), static_cast<float>(q.y()),
            static_cast<float>(q.z())};
  return pose;
}

// The virtual machine's numbers are part of the image's format; the model's are the same.
vm::JointKind ToVm(model::JointType type) {
  static_assert(static_cast<int>(model::JointType::kFixed) ==
                static_cast<int>(vm::JointKind::kFixed));
  return static_cast<vm::JointKind>(type);
}

}  // namespace

Result<vm::KinematicsTables> KinematicsTablesOf(const model::Model& model, int type,
                                                uint64_t model_hash) {
  MORPHBUS_CHECK(type >= 0 && type < static_cast<int>(model.module_types.size()));
  const model::ModuleType& module = model.module_types[type];
  // Everything that a virtual machine knows of its type: names, joints, connectors and their
  // states.
  vm::KinematicsTables tables;
  tables.type_name = module.name;
  tables.model_hash = model_hash;
  // Names come in the order of the model, so that indices are the model's too.
  for (const model::Link& link : module.links) tables.links.push_back(link.name);
  for (const model::Joint& joint : module.joints) {
    tables.joints.push_back({joint.name, ToVm(joint.type), joint.link_a, joint.link_b,
                             ToVm(joint.p_MoJo_M), ToVm(joint.axis), joint.lower, joint.upper,
                             joint.speed});
  }
  for (const model::Connector& connector : module.connectors) {
    vm::KinematicsTables::Connector entry{connector.name, connector.link, {}};
    // A state is a number there; the names of its values stay in the model.
    for (const model::StateVariable& state : connector.states) {
      entry.states.push_back({state.name, static_cast<int>(state.values.size())});
    }
    tables.connectors.push_back(std::move(entry));
  }
  for (const model::Sensor& sensor : module.sensors) {
    tables.sensors.push_back({sensor.name, static_cast<vm::SensorKind>(sensor.type), sensor.link,
                              ToVm(sensor.direction), sensor.range_m});
  }
  // An image counts connections in a byte and their numbers in two.
  constexpr size_t kMaxConnectionTypes = 256;
  if (model.connection_types.size() > kMaxConnectionTypes) {
    return Fail(fmt::format("the model has {} connections; a kinematics image can tell {} apart",
                            model.connection_types.size(), kMaxConnectionTypes));
  }
  // Every connection of which the type is a member.
  for (size_t c = 0; c < model.connection_types.size(); ++c) {
    const model::ConnectionType& connection = model.connection_types[c];
    for (const model::ConnectionOption& option : connection.options) {
      // The tables have fields of fixed width, so that what does not fit must be refused here.
      if (option.number > UINT16_MAX || option.connector_a >= vm::kMaxConnectors ||
          option.connector_b >= vm::kMaxConnectors) {
        return Fail(
            fmt::format("connection '{}' is too large for a kinematics image", connection.name));
      }
      // A type may be member a, member b, or both; each side gets the connection as it sees it.
      const auto a = static_cast<uint8_t>(option.connector_a);
      const auto b = static_cast<uint8_t>(option.connector_b);
      for (const bool is_b : {false, true}) {
        if ((is_b ? connection.type_b : connection.type_a) != type) continue;
        vm::KinConnection& entry = tables.connections.emplace_back();
        entry.connection_type = static_cast<uint8_t>(c);
        entry.number = static_cast<uint16_t>(option.number);
        entry.connector = is_b ? b : a;
        entry.mate_connector = is_b ? a : b;
        entry.is_member_b = is_b;
        // Seen from member b the pose is the inverse.
        entry.X_MN = ToVm(is_b ? option.X_AB.inverse() : option.X_AB);
      }
    }
  }
  return tables;
}

Result<std::string> KinematicsImage(const model::Model& model, int type, uint64_t model_hash) {
  const Result<vm::KinematicsTables> tables = KinematicsTablesOf(model, type, model_hash);
  if (!tables) return Fail(tables.error().message);
  // The encoder knows the capacities of the virtual machine and says which one is exceeded.
  std::string error;
  const std::vector<uint8_t> bytes = vm::EncodeKinematics(*tables, &error);
  if (bytes.empty()) return Fail(error);
  return std::string(bytes.begin(), bytes.end());
}

}  // namespace morphbus::emit
