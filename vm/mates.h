#pragma once
// Who is docked where, and what of each mate's messages is worth keeping.

#include "vm/context.h"

namespace morphbus::vm {

/// Takes the connector sensors, raises on_connect and on_disconnect, and picks the messages that
/// are new, of the mate that the sensor names, and not from an earlier life of it.
void UpdateMates(Context& context, const TickInput& input, Mail* mail);

/// Keeps of each new message where the mate lies and which role it plays; forgets mates that have
/// been silent for kSilentTicks. Call after UpdateMates.
void ReadMates(Context& context, const Mail& mail);

/// The entry of `message` for the connector that is docked to our `mate`, or nullptr.
const DockedLink* DockedHere(const Context& context, const NeighbourMessage& message,
                             const MateRecord& mate);

/// Adds the docked connectors to our own message.
void FillDocked(Context& context, NeighbourMessage* message);

/// Mask of the connectors whose mate is docked and has been heard within kSilentTicks.
uint32_t PresentMates(const Context& context);

}  // namespace morphbus::vm
