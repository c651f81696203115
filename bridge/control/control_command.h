#pragma once
// Commands to a running robot, and as text: what `morphbus control` takes, what CLOCK carries, and
// what `run --commands` reads are one language.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/base/result.h"

namespace morphbus::bridge {

/// What a command does, by the numbers of control_t; the texts are in the same order in
/// control_command.cc.
enum class ControlKind : uint8_t {
  // The run as a whole: it holds between two ticks, goes on, runs some ticks, changes its pace,
  // ends.
  kPause,
  kResume,
  kStep,
  kSpeed,
  kStop,
  // The robot: a force on a body, the process of a module, a module that the run goes on without,
  // two connectors.
  kPush,
  kKill,
  kRestart,
  kLose,
  kConnect,
  kDisconnect,
  // The program: another one for all modules, a command of the one that runs.
  kDeploy,
  kInvoke,
  // Nothing changes: a module, or every one, says in STATUS what it holds.
  kInspect,
  // A parameter of the program gets another value, in all modules at one tick.
  kSet,
};

/// A module, or a part of one: "m2", "m2.c3", "m2.active_block".
struct ControlPart {
  std::string module;  ///< Its name in the robot.
  std::string part;    ///< Name of a link or connector; empty if the module alone is named.
};

/// One command, its numbers checked. Whether the names in it exist, only the run knows. Of the
/// fields only those mean something that the kind has.
struct ControlCommand {
  ControlKind kind = ControlKind::kPause;
  /// The body that is pushed, the module that is killed, restarted, lost or inspected (all if it is
  /// empty), the connector that is taken off or joined, and the connector that it is joined to.
  ControlPart part, mate;
  int64_t steps = 1;  ///< kStep: ticks to run.
  double speed = 0;   ///< kSpeed: times real time; 0: as fast as possible.
  /// kPush: direction in W (north, up, east; any length but 0), force and sim time.
  std::array<double, 3> direction_W = {0, 0, 0};
  double newtons = 0;
  double seconds = 0;  ///< 0: one control tick.
  bool cold = false;   ///< kRestart: the module begins anew, without what it knew.
  /// kRestart: the tick at which it did, where that is the one before the tick of CLOCK that names
  /// the command; 0: it is that tick.
  int64_t from = 0;
  /// kDeploy: path of the program as the user wrote it.
  std::string program;
  /// kDeploy, kSet: hash of the image that the modules go over to; 0 where it is not known yet.
  uint64_t program_hash = 0;
  /// kInvoke: role, its command, and the arguments as they were written.
  std::string role, routine;
  std::vector<std::string> arguments;
  /// kSet: the parameter, "swing" or "Leg.swing", and its value as it was written.
  std::string parameter, value;
  std::string to;  ///< kDeploy, kInvoke: the module that gets it; empty: the root.
  /// kDeploy, kSet: sim time by the root's clock, seconds, at which all modules that have the
  /// program go over to it; nothing: as soon as all can have it.
  std::optional<double> at;
};

/// Whether all modules go over to another image by the command.
inline bool BringsImage(ControlKind kind) {
  return kind == ControlKind::kDeploy || kind == ControlKind::kSet;
}

/// Reads a command, words with blanks between them. Fails in a sentence that says what was expected
/// or suggests the nearest command.
Result<ControlCommand> ParseControl(std::string_view text);

/// Fails, in a sentence, unless ParseControl could have read this command: its numbers are in their
/// ranges, and its names are words that stand in a text as what they are. For commands that came
/// otherwise than as text.
Result<void> CheckControl(const ControlCommand& command);

/// The command as text: equal commands are equal texts, which ParseControl reads back. Numbers have
/// the shortest form that gives the same number, so that a run that is repeated is the same run.
std::string ControlText(const ControlCommand& command);

/// How to write each command, for the help.
std::vector<std::string> ControlUsages();

/// What the sim says of a command, by the numbers of control_answer_t.
struct ControlAnswer {
  enum class State : uint8_t { kDone, kLater, kRefused, kOvertaken };
  /// That of the command which is answered.
  int64_t counter = 0;
  /// kDone: it takes effect at `tick`, which CLOCK names. kLater: it will once the run gets there,
  /// which holds still now. kRefused: nothing happens, for `reason`. kOvertaken: nothing happens,
  /// for a later command came first; it may be given again.
  State state = State::kRefused;
  /// kDone and kLater: the tick.
  int64_t tick = 0;
  int status = 0;      ///< kRefused: exit status for who gave the command.
  std::string reason;  ///< kRefused: a sentence for people.
  /// The command as CLOCK names it; for people, to whom it is shown as it is.
  std::string command;
  /// kDone and kLater, of a deployment: sim time, seconds, at which all modules go over to it,
  /// also where the run chose it.
  std::optional<double> at;
};

}  // namespace morphbus::bridge
