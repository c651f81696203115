#pragma once
// Tasks of a role: startups first, as one task; then behaviors, which repeat; commands and handlers
// as they come. Each task has its own stack; they run in turn, from wait to wait, within a budget.

#include "vm/context.h"
#include "vm/host.h"

namespace morphbus::vm {

/// Prepares the startups of the role just taken.
void StartRole(Context& context);

/// Ends all tasks and forgets what was queued.
void EndTasks(Context& context);

/// Queues a command of the role held. Beyond kQueueDepth waiting the fault is kQueueOverflow, and
/// arguments that do not fit (they came from another module) are kBadState.
void QueueCommand(Context& context, int slot, const Cell* arguments, int count);

/// Queues the role's handlers of an event; `subject` is the connector or joint it is about.
void RaiseEvent(Context& context, Event event, int subject);

/// Runs whatever is due in this tick.
void RunTasks(Context& context, Host& host);

/// Lists the tasks for the status.
void FillTasks(const Context& context, StatusReport* status);

}  // namespace morphbus::vm
