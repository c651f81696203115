#pragma once
// The DCD-VM of one module: one Tick() a control period. No bus, clock, thread or heap.

#include "vm/image/kinematics_image.h"
#include "vm/image/program.h"
#include "vm/module_api.h"
#include "vm/role/roles.h"
#include "vm/run/state.h"

namespace morphbus::vm {

class StepObserver;

/// What a module's program, its neighbours and its own body come together in. All of its changing
/// state is in the VmState that it is given, so that a module that died goes on where it was.
class Vm {
 public:
  /// A cold start resets the state; a warm one goes on from the saved bytes of another VM's state.
  enum class Start { kCold, kResume };

  /// Both images must outlive the VM. `state` is the VM's whole changing state.
  Vm(const VmConfig& config, const VerifiedKinematics& kinematics, const VerifiedProgram& program,
     VmState* state, Start start = Start::kCold);

  /// Computes one tick. Deterministic: equal state and input give equal state and output. Ticks and
  /// sim time must not go back.
  void Tick(const TickInput& input, TickOutput* output);

  /// Shows the observer every instruction of the tasks from the next tick on; nullptr: none. It
  /// changes nothing of what they do.
  void Observe(StepObserver* observer) { observer_ = observer; }

  /// From the next tick on another program runs: tasks end and joints hold their targets. A role of
  /// a name that the new program has as well goes on under it with its conventions, its fields and
  /// startups anew; any other one ends. Where the programs differ in values of parameters alone,
  /// all goes on as it is, with the new values. `program` must outlive the VM.
  void ReplaceProgram(const VerifiedProgram& program);

  /// The tick of the root's clock at this module's tick `tick`, not before the last one computed;
  /// false while it has heard of no root.
  [[nodiscard]] bool RootTick(int64_t tick, int64_t* root_tick) const;

  /// Evaluates one role on what the last Tick knew, as role assignment does; changes nothing.
  [[nodiscard]] RoleCheck CheckRole(int role);
  /// Evaluates a requirement or label of a role, by the number of its function, likewise.
  [[nodiscard]] Evaluation EvaluateAs(int role, int function);

 private:
  /// Write the outputs of the tick, from the state that it has left.
  void FillMessage(Context& context, NeighbourMessage* message);
  /// Adds the values of the shared fields of the role held.
  void FillShared(NeighbourMessage* message);
  void FillTraces(StatusReport* status) const;
  void FillStatus(Context& context, StatusReport* status);

  // What stays the same, the program that runs (it may be replaced), and all that changes. None of
  // them is owned but the configuration.
  const VmConfig config_;
  const VerifiedKinematics& kinematics_;
  const VerifiedProgram* program_;
  VmState& state_;
  StepObserver* observer_ = nullptr;
};

}  // namespace morphbus::vm
