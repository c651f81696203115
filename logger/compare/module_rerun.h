#pragma once
// Runs the program of one logged module again, on what it sensed and heard.

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string>

#include "bridge/wire/channels.h"
#include "compiler/base/result.h"
#include "logger/log/run_log.h"
#include "vm/image/kinematics_image.h"
#include "vm/image/program.h"
#include "vm/image/source_places.h"
#include "vm/module_api.h"
#include "vm/run/interpreter.h"
#include "vm/run/state.h"

namespace morphbus::logger {

/// The call by which a joint was told where to go.
struct CommandingCall {
  /// The program's image that ran, by its hash, and its source files as the image names them.
  uint64_t program_hash = 0;
  vm::SourceFiles files;
  /// The function and the line as the files count it.
  std::string function;
  int line = 0;
};

/// Runs a module again up to `tick` (RerunModule). Returns the call that last told `joint` anything
/// up to that tick. Fails if the log lacks images or messages, if no call told the joint anything,
/// or if the VM commands the joint something else than the log has at that tick: then it did not
/// run as it ran then.
/// @param module  index into RunLog::modules
/// @param joint   index of the joint in the module's type
Result<CommandingCall> FindCommandingCall(const RunLog& log, int module, int joint, int64_t tick);

/// A tick that has been computed again: what the module was told at its start, what it ran, what it
/// sensed and heard, what it said, and what it knows then.
struct ComputedTick {
  const vm::VmConfig& config;
  const vm::VerifiedProgram& program;
  const vm::VerifiedKinematics& kinematics;
  const vm::TickInput& input;
  const vm::TickOutput& output;
  const vm::VmState& state;
};

/// A moment while a task runs: an instruction that runs next or, if `ended` is not null, how the
/// task's run in this tick ended. The innermost call of the task says where it stands.
struct ComputedStep {
  const vm::VerifiedProgram& program;
  const vm::VerifiedKinematics& kinematics;
  const vm::TickInput& input;
  const vm::VmState& state;
  const vm::Task& task;
  const vm::RunResult* ended;
};

/// A message that the module published, and what it says in its place when it runs again. Both are
/// whole messages of the bus; what only its process knows (the header's numbers, how many STATUS it
/// had sent) is the logged one's.
struct MessageAgain {
  bridge::Topic topic;
  int64_t tick = 0;
  int64_t sim_time_us = 0;
  /// Empty: the log has no such message, or the module now says nothing.
  std::span<const uint8_t> logged;
  std::span<const uint8_t> again;
};

/// Who is shown what is computed; each may be empty. Steps come before their tick, messages after.
struct RerunVisitors {
  std::function<void(const ComputedTick&)> tick = {};
  std::function<void(const MessageAgain&)> message = {};
  std::function<void(const ComputedStep&)> step = {};
};

/// What was computed again.
struct RerunSummary {
  int64_t ticks = 0;
  int64_t first_tick = -1, last_tick = -1;
  int64_t messages = 0;  ///< Of the module that were compared, by visitors or not.
  /// Ticks for which the module had a reading, but whose messages the log lacks: it had been lost,
  /// or the log is.
  int64_t skipped = 0;
  /// Neighbours' messages that should have come by the tick, and that the log lacks.
  int64_t unheard = 0;
};

/// Computes every tick of a module up to `last_tick` (all of them by default) again, in the VM and
/// with all that brings programs from module to module, on the readings and messages that the log
/// holds, and shows ticks and messages. Reads the file once; messages may stand in it late by some
/// 60 ticks. Fails if the log cannot be read, or lacks model or images.
/// @param module  index into RunLog::modules
Result<RerunSummary> RerunModule(const RunLog& log, int module, const RerunVisitors& visitors,
                                 int64_t last_tick = std::numeric_limits<int64_t>::max());

}  // namespace morphbus::logger
