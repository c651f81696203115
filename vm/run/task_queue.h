#pragma once
// What waits to become a task of the role held: commands and events. The scheduler
// (vm/role/scheduler.h) starts the tasks.

#include "vm/run/context.h"

namespace morphbus::vm {

/// The running task of a routine, by its index among the role's of that kind; nullptr if it does
/// not run.
const Task* FindTask(const SchedulerState& s, TaskKind kind, int index);

/// Queues a command of the role held. Beyond kQueueDepth waiting the fault is kQueueOverflow, and
/// arguments that do not fit (they came from another module) are kBadInvocation.
void QueueCommand(Context& context, int slot, const Cell* arguments, int count);

/// Queues the role's handlers of an event that is no timer's; `subject` is the connector or joint
/// it is about.
void RaiseEvent(Context& context, Event event, int subject);

}  // namespace morphbus::vm
