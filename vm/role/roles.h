#pragma once
// Which role a module plays, decided from its own surroundings alone.

#include "vm/role/module_services.h"
#include "vm/run/context.h"

namespace morphbus::vm {

/// Whether, and why not, a module could take a role now.
/// True if all requirements of the role return true.
struct RoleCheck {
  bool requirements_hold = false;
  /// True if each label is found by exactly one joint or link.
  bool labels_resolve = false;
  /// The index into RoleInfo::requirements of the first that fails; -1 if none does.
  int failed_requirement = -1;
  /// What that requirement compared last; filled in outside of ticks only, for Vm::CheckRole.
  Comparison measured;
  /// The slot of the first label that does not resolve; -1 if all do.
  int failed_label = -1;
  /// The keyword of the program that the module's type lacks; -1 if it has all.
  int missing_keyword = -1;
  /// True if neighbours' roles were asked for, so that the answer changes with them.
  bool rests_on_roles = false;
  /// What each label resolves to; -1 if to none or several.
  int8_t labels[kMaxLabels] = {};

  /// True if the module could take the role now.
  [[nodiscard]] bool fits() const {
    return requirements_hold && labels_resolve && missing_keyword < 0;
  }
};

/// Evaluates one role on what is known now; changes nothing but the faults that evaluation meets,
/// which are put on the status if `report_faults`.
RoleCheck CheckRole(Context& context, ModuleServices& services, int role, bool report_faults);

/// A requirement or a label, as it is evaluated for a person who asks.
struct Evaluation {
  /// What it returns, or why it returns nothing.
  RunResult result;
  Comparisons compared;
};

/// Evaluates a requirement or label of a role on what is known now, the role's labels resolved as
/// far as they can be; changes nothing and reports no fault.
/// @param function  number of the requirement's or label's function.
Evaluation EvaluateAs(Context& context, ModuleServices& services, int role, int function);

/// Once what requirements rest on has settled: takes, keeps or loses a role. Neighbours' roles
/// settle apart from the structure, and only what asks for them waits for them: so all modules that
/// need not know them take their roles together, before the first of them moves the rest out of its
/// posture.
void UpdateRole(Context& context, ModuleServices& services);

/// Ends the role: tasks end, joints hold, conventions and labels go.
void LeaveRole(Context& context);

/// Prepares the state for another program, which the next tick runs; `context` is of the old one.
/// Tasks end and joints hold. A module whose role the new program has as well, by name, keeps its
/// conventions and goes on in that role in the next tick, startups first; what hangs where counts
/// as settled as it was, so that others take their new roles at once. Where only parameters have
/// other values all goes on.
void CarryOver(Context& context, const VerifiedProgram& next);

/// Remembers the values of the kept fields of the role held, for the next role or program. Call at
/// the end of a tick.
void RememberKept(Context& context);

}  // namespace morphbus::vm
