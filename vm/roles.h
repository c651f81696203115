#pragma once
// Which role a module plays, decided from its own surroundings alone.

#include "vm/context.h"
#include "vm/host.h"

namespace morphbus::vm {

/// Whether, and why not, a module could take a role now.
struct RoleCheck {
  bool requirements_hold = false;
  bool labels_resolve = false;
  int failed_requirement = -1;     ///< Index into RoleInfo::requirements of the first that fails.
  int failed_label = -1;           ///< Slot of the first label that does not resolve.
  int missing_keyword = -1;        ///< Keyword of the program that the module's type lacks.
  bool rests_on_roles = false;     ///< Neighbours' roles were asked for.
  int8_t labels[kMaxLabels] = {};  ///< What each label resolves to; -1 if to none or several.

  [[nodiscard]] bool fits() const {
    return requirements_hold && labels_resolve && missing_keyword < 0;
  }
};

/// Evaluates one role on what is known now; changes nothing but the faults that evaluation meets.
RoleCheck CheckRole(Context& context, Host& host, int role, bool report_faults);

/// Once what requirements rest on has settled: takes, keeps or loses a role. Neighbours' roles
/// settle apart from the structure, and only what asks for them waits for them: so all modules that
/// need not know them take their roles together, before the first of them moves the rest out of its
/// posture.
void UpdateRole(Context& context, Host& host);

/// Ends the role: tasks end, joints hold, conventions and labels go.
void LeaveRole(Context& context);

}  // namespace morphbus::vm
