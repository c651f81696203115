#pragma once
// Calls of a running program's commands by name: `control invoke Role.command ARGUMENTS`.

#include "bridge/control/control_command.h"
#include "compiler/base/result.h"
#include "vm/image/program.h"
#include "vm/module_api.h"

namespace morphbus::tools {

/// The invocation that a command means under `program`: role and command found by name, arguments
/// typed as the program declares them. Fails in a sentence that suggests the nearest name, or says
/// which argument was expected.
Result<vm::InvokeRequest> ResolveCall(const vm::VerifiedProgram& program,
                                      const bridge::ControlCommand& command);

}  // namespace morphbus::tools
