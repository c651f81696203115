#pragma once
// Why a module takes a role, or not: each requirement and label with what was measured.

#include <string>
#include <vector>

#include "tools/plan/run_plan.h"
#include "tools/roles/static_robot.h"
#include "vm/image/kinematics_image.h"
#include "vm/image/program.h"
#include "vm/image/source_places.h"
#include "vm/run/interpreter.h"

namespace morphbus::tools {

/// A requirement or a label of a role, as it is evaluated for one module.
struct ExplainedPart {
  /// The label's name; empty for a requirement.
  std::string label;
  /// Where the program has it.
  vm::SourcePlace place;
  /// Whether the requirement returns true, or the label is one joint or link.
  bool holds = false;
  /// A few words: "holds, measured 2 against 2", "is joint_2".
  std::string finding;
};

/// What one role asks of one module, and what it finds there.
struct RoleExplanation {
  std::string module, role;
  /// Where the program declares the role.
  vm::SourcePlace place;
  /// Abstract roles are taken by nobody; their subroles inherit what they ask for.
  bool is_abstract = false;
  /// Whether the module has a pose, without which it takes no role.
  bool has_pose = false;
  /// Whether the module could take the role.
  bool fits = false;
  /// The role that it has taken; empty: none.
  std::string held;
  /// The first keyword of the role that the module's type lacks; empty if it has all. Nothing else
  /// is evaluated if there is one.
  std::string lacks;
  /// Labels, then requirements, in the order in which the VM evaluates them. All are evaluated,
  /// also behind one that fails.
  std::vector<ExplainedPart> parts;
};

/// What the evaluation of a label's function found: "is joint_2", "fits 2 joints, and one is
/// wanted".
std::string LabelFinding(const vm::FunctionInfo& label, const vm::RunResult& result,
                         const vm::VerifiedKinematics& type);

/// Lets the plan's robot settle, and evaluates roles for one of its modules: `role`, or all that
/// are not abstract, in the program's order, if that is empty. `situation` is how the robot stands;
/// null: as the plan's model declares it. Fails, with the nearest name, if the robot has no such
/// module or the program no such role, and as SettleRoles does.
Result<std::vector<RoleExplanation>> ExplainRoles(const RunPlan& plan, const std::string& module,
                                                  const std::string& role,
                                                  const Situation* situation = nullptr);

}  // namespace morphbus::tools
