#pragma once
// The DCD-VM of one module: one Tick() a control period. No bus, clock, thread or heap.

#include "vm/kinematics_image.h"
#include "vm/module_api.h"
#include "vm/program.h"
#include "vm/state.h"

namespace morphbus::vm {

/// Whether, and why not, a module could take a role now.
struct RoleCheck {
  bool requirements_hold = false;
  bool labels_resolve = false;
  int failed_requirement = -1;  ///< Index into RoleInfo::requirements of the first that fails.
  int failed_label = -1;        ///< Slot of the first label that does not resolve.
  int missing_keyword = -1;     ///< Keyword of the program that the module's type lacks.
};

class Vm {
 public:
  /// Both images must outlive the VM. `state` is the VM's whole changing state.
  /// A cold start resets it; a warm one goes on from the saved bytes of another VM's state.
  enum class Start { kCold, kResume };
  Vm(const VmConfig& config, const VerifiedKinematics& kinematics, const VerifiedProgram& program,
     VmState* state, Start start = Start::kCold);

  /// Computes one tick. Deterministic: equal state and input give equal state and output.
  void Tick(const TickInput& input, TickOutput* output);

  /// From the next tick on another program runs: the role and its tasks end, joints hold their
  /// targets, conventions go. `program` must outlive the VM.
  void ReplaceProgram(const VerifiedProgram& program);

  /// Evaluates one role on what the last Tick knew, as role assignment does; changes nothing.
  RoleCheck CheckRole(int role);

 private:
  const VmConfig config_;
  const VerifiedKinematics& kinematics_;
  const VerifiedProgram* program_;
  VmState& state_;
};

}  // namespace morphbus::vm
