#include "tools/roles/binding_comparison.h"

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
  /// By module and joint of its type, the index into `joints`; -1 if the joint is fixed.
  std::vector<std::vector<int>> index_of;

  Bound(const model::Model& of, const model::Robot& robot_of, const StaticRoles& settled,
        const std::vector<congruence::JointRef>& compared)
      : model(of),
        robot(robot_of),
        roles(settled),
        joints(compared),
        body_of(model::BodiesOf(of, robot_of)),
        index_of(robot_of.modules.size()) {
    for (size_t m = 0; m < index_of.size(); ++m) {
      index_of[m].assign(TypeOf(static_cast<int>(m)).joints.size(), -1);
    }
    for (size_t j = 0; j < joints.size(); ++j) {
      index_of[joints[j].module][joints[j].joint] = static_cast<int>(j);
    }
  }

  [[nodiscard]] const model::ModuleType& TypeOf(int module) const {
    return model.module_types[robot.modules[module].type];
  }
  /// The joint of that name by index into `joints`; -1 if it is fixed or none.
  [[nodiscard]] int JointOf(int module, const std::string& name) const {
    const std::vector<model::Joint>& own = TypeOf(module).joints;
    for (size_t j = 0; j < own.size(); ++j) {
      if (own[j].name == name) return index_of[module][j];
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
  return "";
}

/// The sign of a module's joint under setJointAxis; 0 without one. Signs are listed under a label
/// of the joint, if it has one.
int SignOf(const StaticRole& role, const std::string& joint) {
  for (const auto& [name, sign] : role.signs) {
    const auto label = role.labels.find(name);
    if ((label == role.labels.end() ? name : label->second) == joint) return sign;
  }
  return 0;
}

/// The joints that values of the program turn otherwise than their counterparts, of modules whose
/// counterparts have the same role.
void AddTurnedOtherwise(const Bound& a, const Bound& b, const congruence::Mapping& mapping,
                        std::vector<std::string>* differences) {
  for (size_t j = 0; j < a.joints.size(); ++j) {
    const congruence::JointRef& in_a = a.joints[j];
    const congruence::JointRef& in_b = b.joints[mapping.joints[j].to];
    const StaticRole& role_a = a.roles.modules[in_a.module];
    const StaticRole& role_b = b.roles.modules[in_b.module];
    if (mapping.module_to[in_a.module] != in_b.module || role_a.role != role_b.role) continue;
    const std::string& name_a = a.TypeOf(in_a.module).joints[in_a.joint].name;
    const std::string& name_b = b.TypeOf(in_b.module).joints[in_b.joint].name;
    // They turn alike if the signs differ as the joints do.
    const int sign_a = SignOf(role_a, name_a), sign_b = SignOf(role_b, name_b);
    const int wanted = mapping.joints[j].sign > 0 ? sign_a : -sign_a;
    if (sign_b == wanted) continue;
    differences->push_back(fmt::format(
        "{} and {}, {}: {}", role_a.module, role_b.module, role_a.role,
        sign_a == 0 || sign_b == 0
            ? fmt::format("of {} and its counterpart {} only one has a convention (setJointAxis)",
                          name_a, name_b)
            : fmt::format("{} and its counterpart {} turn opposite ways", name_a, name_b)));
  }
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
    // The labels of different roles have nothing to do with each other.
    const StaticRole& role_b = b.roles.modules[to];
    if (role_a.role != role_b.role) {
      const auto plays = [](const StaticRole& role) {
        return role.role.empty() ? "no role" : role.role;
      };
      differences.push_back(fmt::format("{} plays {}, its counterpart {} plays {}", role_a.module,
                                        plays(role_a), role_b.module, plays(role_b)));
      continue;
    }
    // Of one role each label stands for counterparts.
    for (const auto& [label, target] : role_a.labels) {
      const std::string what = LabelDifference(a, b, module, to, label, mapping);
      if (what.empty()) continue;
      differences.push_back(fmt::format("{} and {}, {}: label {} {}", role_a.module, role_b.module,
                                        role_a.role, label, what));
    }
  }
  AddTurnedOtherwise(a, b, mapping, &differences);
  return differences;
}

}  // namespace

BindingComparison CompareBindings(const model::Model& model, const model::Robot& a,
                                  const StaticRoles& roles_a, const model::Robot& b,
                                  const StaticRoles& roles_b,
                                  const congruence::Congruence& answer) {
  const Bound bound_a(model, a, roles_a, answer.joints_a);
  const Bound bound_b(model, b, roles_b, answer.joints_b);
  // Of several mappings the one under which the least is different tells most.
  std::optional<BindingComparison> best;
  // Programs speak of the robot frame, so that what keeps it comes before what turns a robot over;
  // the first mapping keeps it if any does.
  const bool in_frame = !answer.mappings.empty() && answer.mappings.front().keeps_frame;
  for (size_t i = 0; i < answer.mappings.size(); ++i) {
    if (in_frame && !answer.mappings[i].keeps_frame) continue;
    std::vector<std::string> differences = DifferencesUnder(bound_a, bound_b, answer.mappings[i]);
    if (best && best->differences.size() <= differences.size()) continue;
    best = BindingComparison{i, std::move(differences)};
    if (best->differences.empty()) break;
  }
  return best.value_or(BindingComparison());
}

}  // namespace morphbus::tools
