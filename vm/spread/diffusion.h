#pragma once
// Invocations, hop by hop, exactly once. Each module accepts an origin's invocations in the order
// of their ids, runs those that fit its role, and keeps each until every present neighbour has said
// that it has it; so losses, repeats and late messages do no harm, and a neighbour that docks later
// gets what is still under way.

#include "vm/run/context.h"

namespace morphbus::vm {

/// Takes acknowledgements and new invocations; queues commands of the role held.
void ReceiveInvocations(Context& context, const Inbox& inbox);

/// Issues an invocation to every module that plays `role` (or a subrole), this one included, or
/// only to the module `target` if that is not -1. If too many are still under way it is not sent;
/// returns false then, and *fault says why.
bool Issue(Context& context, int role, int command, const Cell* arguments, int count, int target,
           Fault* fault);

/// Issues what came from outside in this tick.
void IssueRequests(Context& context, const TickInput& input);

/// Drops what every present neighbour has.
void DropAcknowledged(Context& context);

/// Adds acknowledgements and invocations to our own message; returns the bytes they take.
int FillInvocations(Context& context, NeighbourMessage* message);

}  // namespace morphbus::vm
