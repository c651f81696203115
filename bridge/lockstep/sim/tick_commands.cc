#include "bridge/lockstep/sim/tick_commands.h"

#include <utility>

namespace morphbus::bridge {

TickCommands::TickCommands(size_t num_modules) : commands_(num_modules), there_(num_modules) {
  for (morphbus::actuator_t& command : commands_) command.header.program_hash = 0;
}

bool TickCommands::Keep(size_t module, morphbus::actuator_t* command) {
  if (there_[module]) return false;
  there_[module] = true;
  // The caller gets the memory of the last command for the next message that it decodes.
  std::swap(commands_[module], *command);
  return true;
}

void TickCommands::Actuate(SimulatedRobot* robot,
                           const std::function<void(size_t module)>& missing) {
  // By place, since the order of arrival must not change how the robot moves.
  for (size_t i = 0; i < commands_.size(); ++i) {
    if (there_[i]) {
      robot->Actuate(commands_[i]);
    } else {
      missing(i);
    }
    there_[i] = false;
  }
}

}  // namespace morphbus::bridge
