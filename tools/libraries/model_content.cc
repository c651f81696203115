#include "tools/libraries/model_content.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "compiler/base/nearest_name.h"
#include "compiler/model/pose_numbers.h"

namespace morphbus {
namespace {

/// The names of things that have one.
template <class Things>
std::vector<std::string> Names(const Things& things) {
  std::vector<std::string> names;
  for (const auto& thing : things) names.push_back(thing.name);
  return names;
}

/// A type of module as the library tells it.
ModuleType TypeToPublic(const model::ModuleType& type) {
  return {type.name, Names(type.links), Names(type.joints), Names(type.connectors),
          Names(type.sensors)};
}

/// A connection of `model` as the library tells it.
ConnectionType ConnectionToPublic(const model::Model& model,
                                  const model::ConnectionType& connection) {
  const model::ModuleType& a = model.module_types[connection.type_a];
  const model::ModuleType& b = model.module_types[connection.type_b];
  ConnectionType type = {connection.name, a.name, b.name, {}};
  for (const model::ConnectionOption& option : connection.options) {
    type.options.push_back({option.number, a.connectors[option.connector_a].name,
                            b.connectors[option.connector_b].name, ToPublic(option.X_AB)});
  }
  return type;
}

}  // namespace

Pose ToPublic(const model::Pose& X) {
  const model::PoseNumbers numbers = model::NumbersOf(X);
  return {numbers.position, numbers.rotation};
}

void ThrowUnknown(std::string_view what, std::string_view name,
                  const std::vector<std::string>& names) {
  std::string text = "there is no " + std::string(what) + " '" + std::string(name) + "'";
  const std::string nearest = NearestName(std::string(name), names);
  // Of thousands of names a list would help nobody.
  constexpr size_t kMostListed = 20;
  if (!nearest.empty()) {
    text += " (did you mean '" + nearest + "'?)";
  } else if (!names.empty() && names.size() <= kMostListed) {
    text += "; there is ";
    for (const std::string& one : names) text += (&one == names.data() ? "" : ", ") + one;
  }
  throw Failure(text);
}

Model::Content::Content(model::Model the_model) : model(std::move(the_model)) {
  for (const model::ModuleType& type : model.module_types) {
    module_types.push_back(TypeToPublic(type));
  }
  for (const model::ConnectionType& type : model.connection_types) {
    connection_types.push_back(ConnectionToPublic(model, type));
  }
}

Robot::Content::Content(std::shared_ptr<const Model::Content> the_model, model::Robot the_robot)
    : of_model(std::move(the_model)), robot(std::move(the_robot)) {
  const model::Model& model = of_model->model;
  for (int m = 0; m < static_cast<int>(robot.modules.size()); ++m) {
    const model::ModuleInstance& instance = robot.modules[m];
    const model::ModuleType& type = model.TypeOf(robot, m);
    modules.push_back({instance.name, type.name});
    // Links and joints of all modules stand in one row, each module's behind those before it.
    const int first = static_cast<int>(links.size());
    first_link.push_back(first);
    first_joint.push_back(static_cast<int>(joints.size()));
    for (const model::Link& link : type.links) {
      links.push_back({instance.name + "." + link.name, m, link.mass_kg});
    }
    for (size_t j = 0; j < type.joints.size(); ++j) {
      const model::Joint& joint = type.joints[j];
      joints.push_back({instance.name + "." + joint.name, m, static_cast<JointType>(joint.type),
                        first + joint.link_a, first + joint.link_b, joint.lower, joint.upper,
                        joint.effort, joint.speed, instance.start[j]});
    }
  }
  for (const model::Docking& docking : robot.dockings) {
    connections.push_back({docking.module_a, docking.module_b, model.EndA(robot, docking).name,
                           model.EndB(robot, docking).name,
                           model.connection_types[docking.connection_type].name,
                           model.OptionOf(docking).number});
  }
}

model::JointValues Robot::Content::ByModule(std::span<const double> values) const {
  if (values.size() != joints.size()) {
    throw Failure("robot " + robot.name + " has " + std::to_string(joints.size()) +
                  " joints, and here are " + std::to_string(values.size()) + " values");
  }
  if (!std::ranges::all_of(values, [](double v) { return std::isfinite(v); })) {
    throw Failure("a joint value of robot " + robot.name + " is no number");
  }
  model::JointValues by_module;
  for (size_t m = 0; m < modules.size(); ++m) {
    const size_t count = robot.modules[m].start.size();
    const auto first = values.begin() + first_joint[m];
    by_module.emplace_back(first, first + static_cast<std::ptrdiff_t>(count));
  }
  return by_module;
}

}  // namespace morphbus
