#pragma once
// The commands that people gave to a run, as a log has them. `info`, `compare`, `report` and
// `replay` all learn of them here.

#include <cstdint>
#include <morphbus/sim_clock_t.hpp>
#include <string>
#include <vector>

namespace morphbus::logger {

/// A command that took effect.
struct ClockCommand {
  /// The tick in which CLOCK names it, and its sim time (µs).
  int64_t tick = 0;
  int64_t time_us = 0;
  /// As `run --commands` reads it (bridge/control/control_command.h). Of a damaged log it may be
  /// any text.
  std::string text;
};

/// Those that one CLOCK names, in their order.
std::vector<ClockCommand> CommandsOf(const morphbus::sim_clock_t& clock);

}  // namespace morphbus::logger
