#pragma once
// What is inside the models and robots of the library model, for the libraries above it.

#include <morphbus/model/model.h>

#include <string>
#include <string_view>
#include <vector>

#include "compiler/model/forward_kinematics.h"
#include "compiler/model/robot_model.h"

namespace morphbus {

/// A model, and what the library tells of it.
class MORPHBUS_HIDDEN Model::Content {
 public:
  explicit Content(model::Model model);
  /// A copy would leave robots of the model behind.
  Content(const Content&) = delete;
  Content& operator=(const Content&) = delete;

  model::Model model;
  std::vector<ModuleType> module_types;
  std::vector<ConnectionType> connection_types;
};

/// A robot, and what the library tells of it.
class MORPHBUS_HIDDEN Robot::Content {
 public:
  /// `robot` is one of the model's, or one of the same modules (a variant).
  Content(std::shared_ptr<const Model::Content> of_model, model::Robot robot);

  /// Values in the order of `joints`, by module. Throws Failure for another number of them.
  [[nodiscard]] model::JointValues ByModule(std::span<const double> values) const;

  std::shared_ptr<const Model::Content> of_model;
  model::Robot robot;
  std::vector<Module> modules;
  std::vector<Link> links;
  std::vector<Joint> joints;
  std::vector<Connection> connections;
  /// For each module the place of its first link in `links`, and of its first joint in `joints`.
  std::vector<int> first_link, first_joint;
};

/// A pose as the libraries tell it.
Pose ToPublic(const model::Pose& X);

/// Throws a Failure which says that there is no `what` ("robot") so called, with the nearest of
/// `names`.
[[noreturn]] void ThrowUnknown(std::string_view what, std::string_view name,
                               const std::vector<std::string>& names);

}  // namespace morphbus
