#pragma once
// Invocations, hop by hop, exactly once. Each module accepts an origin's invocations in the order
// of their ids, runs those that fit its role, and keeps each until every present mate has said that
// it has it; so losses, repeats and late messages do no harm, and a mate that docks later gets what
// is still under way.

#include "vm/context.h"

namespace morphbus::vm {

/// Takes acknowledgements and new invocations; queues commands of the role held.
void ReceiveInvocations(Context& context, const Mail& mail);

/// Issues an invocation to every module that plays `role` (or a subrole), this one included.
/// kQueueOverflow if too many are still under way: it is not sent then.
FaultCode Issue(Context& context, int role, int command, const Cell* arguments, int count);

/// Issues what came from outside in this tick.
void IssueRequests(Context& context, const TickInput& input);

/// The mate on this connector is another one now: it has acknowledged nothing.
void ForgetAcks(Context& context, int connector);

/// Drops what every present mate has.
void DropAcknowledged(Context& context);

/// Adds acknowledgements and invocations to our own message; returns the bytes they take.
int FillInvocations(Context& context, NeighbourMessage* message);

}  // namespace morphbus::vm
