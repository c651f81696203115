#pragma once
// What people did to a run, as its CLOCK names it.

#include <morphbus/sim_clock_t.hpp>
#include <vector>

#include "bridge/control/control_command.h"

namespace morphbus::bridge {

/// The commands that a CLOCK names, in their order: they take effect in its tick. Those of a later
/// version that cannot be read here are left out; as text they stand in the CLOCK.
std::vector<ControlCommand> CommandsIn(const morphbus::sim_clock_t& clock);

}  // namespace morphbus::bridge
