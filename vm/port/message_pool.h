#pragma once
// Room for the messages that a module hears in one tick: of as many connectors as can be docked.

#include "vm/module_api.h"

namespace morphbus::vm {

class MessagePool {
 public:
  /// Where the next message of a connector goes; null if so many docked ones have spoken in this
  /// tick already. What it takes from another connector is taken out of the input.
  NeighbourMessage* RoomFor(int connector, TickInput* input);

 private:
  NeighbourMessage messages_[kMaxNeighbours];
};

}  // namespace morphbus::vm
