#pragma once
// What the modules of one process decode, compute and encode for a moment.

#include <cstdint>
#include <morphbus/sensors_t.hpp>
#include <morphbus/transform_t.hpp>
#include <vector>

#include "bridge/lockstep/module_participant.h"
#include "vm/module_api.h"

namespace morphbus::bridge {

/// Nothing in it is needed any more when a handler of the bus, or OnTime, returns.
struct ModuleParticipant::Scratch {
  /// The last messages decoded or encoded, whose memory is used again and again.
  morphbus::sensors_t sensors;
  morphbus::transform_t transform;
  /// What the controller answered to the tick that is published.
  vm::TickOutput output;
  /// Whom the module is mated to, by the SENSORS that is taken and in the tick that is computed.
  std::vector<uint16_t> sensed_mates;

  /// The one of this thread, on which its modules take turns.
  static Scratch& OfThread() {
    static thread_local Scratch scratch;
    return scratch;
  }
};

}  // namespace morphbus::bridge
