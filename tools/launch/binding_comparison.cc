#include "tools/launch/binding_comparison.h"

#include <fmt/format.h>

#include <optional>

#include "compiler/model/kinematic_graph.h"

namespace morphbus::tools {
namespace {

/// A robot with what its modules settled on.
struct Bound {
  const model::Model& model;
  const model::Robot& robot;
  const StaticRoles& roles;
  const std::vector<congruence::JointRef>& joints;  ///< Of the comparison.
  std::vector<std::vector<int>> body_of;            ///< As model::BodiesOf.

  [[nodiscard]] const model::ModuleType& TypeOf(int module) const {
    return model.module_types[robot.modules[module].type];
  }
  /// The joint of that name by index into `joints`; -1 if it is fixed or none.
  [[nodiscard]] int JointOf(int module, const std::string& name) const {
    for (size_t j = 0; j < joints.size(); ++j) {
      const congruence::JointRef& ref = joints[j];
      if (ref.module == module && TypeOf(module).joints[ref.joint].name == name) {
        return static_cast<int>(j);
      }
    }
    return -1;
  }
  /// The body of the link of that name; -1 if there is none.
  [[nodiscard]] int BodyOf(int module, const std::string& name) const {
    const std::vector<model::Link>& links = TypeOf(module).links;
    for (size_t l = 0; l < links.size(); ++l) {
      if (links[l].name == name) return body_of[module][l];
    }
    return -1;
  }
};

/// In what the thing that stands for a label in `b` is not the counterpart of what stands for it in
/// `a`; empty if it is.
std::string LabelDifference(const Bound& a, const Bound& b, int module, int to,
                            const std::string& label, const congruence::Mapping& mapping) {
  const StaticRole &role_a = a.roles.modules[module], &role_b = b.roles.modules[to];
  const auto in_b = role_b.labels.find(label);
  if (in_b == role_b.labels.end()) return "stands for nothing there";
  const std::string& name_a = role_a.labels.at(label);
  // Links are the counterparts of links if their bodies are.
  const int joint = a.JointOf(module, name_a);
  if (joint < 0) {
    const int body_a = a.BodyOf(module, name_a), body_b = b.BodyOf(to, in_b->second);
    const bool same = body_a >= 0 && body_b >= 0 && mapping.body_to[body_a] == body_b;
    return same ? ""
                : fmt::format("is {} here, and {} of another body there", name_a, in_b->second);
  }
  const congruence::JointImage& image = mapping.joints[joint];
  if (b.JointOf(to, in_b->second) != image.to) {
    // The counterpart may even be a joint of another module.
    const congruence::JointRef& ref = b.joints[image.to];
    return fmt::format("is {} here and {} there, not {}.{}", name_a, in_b->second,
                       b.robot.modules[ref.module].name,
                       b.TypeOf(ref.module).joints[ref.joint].name);
  }
  // Program values turn joint and counterpart alike if the signs differ as the joints do.
  const auto sign_a = role_a.signs.find(label), sign_b = role_b.signs.find(label);
  const bool has_a = sign_a != role_a.signs.end(), has_b = sign_b != role_b.signs.end();
  if (has_a != has_b) return "has a convention (setJointAxis) on one of them only";
  if (has_a && sign_b->second != (image.sign > 0 ? sign_a->second : -sign_a->second)) {
    return "turns the other way there";
  }
  return "";
}

/// What is bound otherwise under one mapping.
std::vector<std::string> DifferencesUnder(const Bound& a, const Bound& b,
                                          const congruence::Mapping& mapping) {
  std::vector<std::string> differences;
  for (size_t m = 0; m < a.robot.modules.size(); ++m) {
    const int module = static_cast<int>(m), to = mapping.module_to[m];
    const StaticRole& role_a = a.roles.modules[m];
    // Whose joints belong to several modules has no one to be compared with.
    if (to < 0) {
      if (!role_a.role.empty()) {
        differences.push_back(fmt::format("{} plays {}; its joints belong to several modules of {}",
                                          role_a.module, role_a.role, b.robot.name));
      }
      continue;
    }
    const StaticRole& role_b = b.roles.modules[to];
    if (role_a.role != role_b.role) {
      const auto plays = [](const StaticRole& role) {
        return role.role.empty() ? "no role" : role.role;
      };
      differences.push_back(fmt::format("{} plays {}, its counterpart {} plays {}", role_a.module,
                                        plays(role_a), role_b.module, plays(role_b)));
      continue;
    }
    for (const auto& [label, target] : role_a.labels) {
      const std::string what = LabelDifference(a, b, module, to, label, mapping);
      if (what.empty()) continue;
      differences.push_back(fmt::format("{} and {}, {}: label {} {}", role_a.module, role_b.module,
                                        role_a.role, label, what));
    }
  }
  return differences;
}

}  // namespace

BindingComparison CompareBindings(const model::Model& model, const model::Robot& a,
                                  const StaticRoles& roles_a, const model::Robot& b,
                                  const StaticRoles& roles_b,
                                  const congruence::Congruence& answer) {
  const Bound bound_a{model, a, roles_a, answer.joints_a, model::BodiesOf(model, a)};
  const Bound bound_b{model, b, roles_b, answer.joints_b, model::BodiesOf(model, b)};
  std::optional<BindingComparison> best;
  for (size_t i = 0; i < answer.mappings.size(); ++i) {
    std::vector<std::string> differences = DifferencesUnder(bound_a, bound_b, answer.mappings[i]);
    if (best && best->differences.size() <= differences.size()) continue;
    best = BindingComparison{i, std::move(differences)};
    if (best->differences.empty()) break;
  }
  return best.value_or(BindingComparison());
}

}  // namespace morphbus::tools
