#pragma once
// Who is docked where, and what of each neighbour's messages is worth keeping.

#include "vm/run/context.h"

namespace morphbus::vm {

/// Takes the connector sensors, raises on_connect and on_disconnect, and picks the messages that
/// are new, of the neighbour that the sensor names, and not from an earlier life of it.
void UpdateNeighbours(Context& context, const TickInput& input, Inbox* inbox);

/// Keeps of each new message where the neighbour lies and which role it plays; forgets neighbours
/// that have been silent for kSilentTicks. Call after UpdateNeighbours.
void ReadNeighbourMessages(Context& context, const Inbox& inbox);

/// The entry of `message` for the connector that is docked to our `neighbour`, or nullptr.
const DockedLink* DockedHere(const Context& context, const NeighbourMessage& message,
                             const NeighbourRecord& neighbour);

/// Adds the docked connectors to our own message.
void FillDocked(Context& context, NeighbourMessage* message);

/// Mask of the connectors whose neighbour is docked and has been heard within kSilentTicks.
uint32_t PresentNeighbours(const Context& context);

}  // namespace morphbus::vm
