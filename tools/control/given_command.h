#pragma once
// A command that was given to a running simulator.

#include <cstdint>
#include <string>

#include "bridge/control/control_command.h"
#include "tools/machine/wall_clock.h"

namespace morphbus::tools {

/// The counter of a command that has no sender who awaits an answer, as those of a script.
inline constexpr int64_t kNobody = -1;

/// A command, and whether it was answered.
struct GivenCommand {
  int64_t counter = 0;
  bridge::ControlCommand command;
  std::string text;  ///< As CLOCK names it; written once.
  bool answered = false;
  bool silent = false;  ///< A step of another command: it is neither answered nor named.
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
