#include "logger/log/clock_commands.h"

namespace morphbus::logger {

std::vector<ClockCommand> CommandsOf(const morphbus::sim_clock_t& clock) {
  std::vector<ClockCommand> commands;
  for (const std::string& text : clock.controls) {
    commands.push_back({clock.header.tick, clock.header.sim_time_us, text});
  }
  return commands;
}

}  // namespace morphbus::logger
