#pragma once
// Runs the program of one logged module again, on what it sensed and heard.

#include <cstdint>
#include <functional>
#include <string>

#include "compiler/base/result.h"
#include "logger/log/run_log.h"
#include "vm/image/kinematics_image.h"
#include "vm/image/program.h"
#include "vm/module_api.h"

namespace morphbus::logger {

/// The call by which a joint was told where to go.
struct CommandingCall {
  /// The program's image that ran, by its hash, and its source as the image names it.
  uint64_t program_hash = 0;
  std::string source;
  /// The function and the line in the source, from 1.
  std::string function;
  int line = 0;
};

/// Reads the file of `log` once more up to `tick`, and computes every tick of a module in the VM on
/// the readings and messages that the log holds. Returns the call that last told `joint` anything
/// up to that tick. Fails if the log lacks images or messages, if no call told the joint anything,
/// or if the VM commands the joint something else than the log has at that tick: then it did not
/// run as it ran then.
/// @param module  index into RunLog::modules
/// @param joint   index of the joint in the module's type
Result<CommandingCall> FindCommandingCall(const RunLog& log, int module, int joint, int64_t tick);

/// A tick that has been computed again: what the module was told at its start, what it ran, what it
/// sensed and heard, and what it said.
struct ComputedTick {
  const vm::VmConfig& config;
  const vm::VerifiedProgram& program;
  const vm::VerifiedKinematics& kinematics;
  const vm::TickInput& input;
  const vm::TickOutput& output;
};
using TickVisitor = std::function<void(const ComputedTick&)>;

/// Computes every tick of a module up to `tick` in the VM again, as FindCommandingCall does, and
/// shows each to `visit`. Fails for the same reasons, but for a joint that nobody commands.
Result<void> RerunModule(const RunLog& log, int module, int64_t tick, const TickVisitor& visit);

}  // namespace morphbus::logger
