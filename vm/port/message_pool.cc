#include "vm/port/message_pool.h"

#include <initializer_list>

namespace morphbus::vm {

NeighbourMessage* MessagePool::RoomFor(int connector, TickInput* input) {
  // That of the module behind this connector, which has said something newer.
  if (input->messages[connector] != nullptr) {
    return &messages_[input->messages[connector] - messages_];
  }
  // Otherwise one that no connector uses, or else that of a module which only passes by, if the one
  // behind this connector is docked.
  for (const bool makes_way : {false, true}) {
    for (NeighbourMessage& message : messages_) {
      int user = 0;
      while (user < kMaxConnectors && input->messages[user] != &message) ++user;
      if (user == kMaxConnectors) return &message;
      if (makes_way && input->connectors[connector].docked && !input->connectors[user].docked) {
        input->messages[user] = nullptr;
        return &message;
      }
    }
  }
  return nullptr;
}

}  // namespace morphbus::vm
