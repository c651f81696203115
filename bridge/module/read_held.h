#pragma once
// Reads out of a VM's state what its module holds, by name: for STATUS of a running robot
// (`control inspect`) and for a module that a log runs again (`replay --into`).

#include <cstdint>
#include <vector>

#include "bridge/wire/held_state.h"
#include "vm/image/kinematics_image.h"
#include "vm/image/program.h"
#include "vm/run/state.h"

namespace morphbus::bridge {

/// The parameters and variables of a call, in their order. A variable that has no value at the
/// byte offset `pc` of the function, where the call stands, has an empty one. `cells` are those of
/// the call's task.
std::vector<HeldValue> ReadLocals(const vm::VerifiedProgram& program,
                                  const vm::VerifiedKinematics& kinematics, const vm::Frame& call,
                                  uint32_t pc, const vm::Cell* cells);

/// The fields of the role held, in their order; none without a role.
std::vector<HeldValue> ReadFields(const vm::VerifiedProgram& program,
                                  const vm::VerifiedKinematics& kinematics,
                                  const vm::RoleState& role);

/// A task of the role with its calls, without variables that have no value yet. The innermost call
/// has the line at which the task came to rest.
HeldTask ReadTask(const vm::VerifiedProgram& program, const vm::VerifiedKinematics& kinematics,
                  const vm::RoleInfo& role, const vm::Task& task);

/// All that the module holds, without variables that have no value yet. `state` is that of a VM
/// that runs the program on a module of the type.
HeldState ReadHeld(const vm::VerifiedProgram& program, const vm::VerifiedKinematics& kinematics,
                   const vm::VmState& state);

}  // namespace morphbus::bridge
