#pragma once
// The DCD-VM of one module: one Tick() a control period. No bus, clock, thread or heap.

#include "vm/kinematics_image.h"
#include "vm/module_api.h"
#include "vm/program.h"
#include "vm/state.h"

namespace morphbus::vm {

/// What a module is told when it is started (spec: id, type, program, root).
struct VmConfig {
  uint16_t module_id = 0;
  uint32_t incarnation = 1;
  int64_t tick_us = 20000;      ///< Control period, microseconds of sim time.
  bool is_root = false;
  uint8_t root_link = 0;        ///< The link whose pose is broadcast.
  PoseF X_RL_root;              ///< Its pose in the robot frame.
};

class Vm {
 public:
  /// Both images must outlive the VM. `state` is the VM's whole changing state; it is reset.
  Vm(const VmConfig& config, const VerifiedKinematics& kinematics, const VerifiedProgram& program,
     VmState* state);

  /// Computes one tick. Deterministic: equal state and input give equal state and output.
  void Tick(const TickInput& input, TickOutput* output);

 private:
  const VmConfig config_;
  const VerifiedKinematics& kinematics_;
  const VerifiedProgram& program_;
  VmState& state_;
};

}  // namespace morphbus::vm
