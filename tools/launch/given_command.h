#pragma once
// A command that was given to a running simulator.

#include <cstdint>

#include "bridge/control/control_command.h"
#include "tools/launch/wall_clock.h"

namespace morphbus::tools {

/// The counter of a command that nobody awaits an answer to, as those of a script.
inline constexpr int64_t kNobody = -1;

/// A command, and whether it was answered.
struct GivenCommand {
  int64_t counter = 0;
  bridge::ControlCommand command;
  bool answered = false;
  bool silent = false;  ///< A step of another command: nobody hears of it, nor does CLOCK.
  WallTimer since = {};
};

/// Whether a command is about a module as a process.
inline bool OfProcess(bridge::ControlKind kind) {
  return kind == bridge::ControlKind::kKill || kind == bridge::ControlKind::kRestart ||
         kind == bridge::ControlKind::kLose;
}

/// Whether a module begins anew by this command.
inline bool IsCold(const bridge::ControlCommand& command) {
  return command.kind == bridge::ControlKind::kRestart && command.cold;
}

}  // namespace morphbus::tools
