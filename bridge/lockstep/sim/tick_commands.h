#pragma once
// The commands of the tick that is out.

#include <cstdint>
#include <functional>
#include <morphbus/actuator_t.hpp>
#include <vector>

#include "bridge/lockstep/sim/simulated_robot.h"

namespace morphbus::bridge {

/// Keeps one command of each module until everybody has answered and the robot may move.
class TickCommands {
 public:
  /// @param num_modules  of the run; they are called by place.
  explicit TickCommands(size_t num_modules);

  /// Keeps a module's command of the tick that is out, in exchange for the last one that it had.
  /// False, with nothing changed, if there is one already: only the first one is used.
  bool Keep(size_t module, morphbus::actuator_t* command);
  /// Gives the robot all commands in order of modules, whatever the order of arrival, so that it
  /// moves the same every time. The next tick has none. `missing` is called for each module without
  /// a command.
  void Actuate(SimulatedRobot* robot, const std::function<void(size_t module)>& missing);
  /// Hash of the program that a module ran when its last command was kept; 0 before.
  [[nodiscard]] uint64_t program_of(size_t module) const {
    return static_cast<uint64_t>(commands_[module].header.program_hash);
  }

 private:
  std::vector<morphbus::actuator_t> commands_;
  std::vector<bool> there_;  ///< Whether the command is of the tick that is out.
};

}  // namespace morphbus::bridge
