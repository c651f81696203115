#include "bridge/observe/clock_commands.h"

#include <string>
#include <utility>

namespace morphbus::bridge {

std::vector<ControlCommand> CommandsIn(const morphbus::sim_clock_t& clock) {
  std::vector<ControlCommand> commands;
  for (const std::string& text : clock.controls) {
    Result<ControlCommand> command = ParseControl(text);
    if (command) commands.push_back(std::move(*command));
  }
  return commands;
}

}  // namespace morphbus::bridge
