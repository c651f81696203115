#include "vm/run/task_queue.h"

namespace morphbus::vm {

// A routine runs at most once at a time, so kind and index name a task.
const Task* FindTask(const SchedulerState& s, TaskKind kind, int index) {
  for (const Task& task : s.tasks) {
    if (task.used && task.kind == kind && task.index == index) return &task;
  }
  return nullptr;
}

void QueueCommand(Context& context, int slot, const Cell* arguments, int count) {
  SchedulerState& s = context.state.scheduler;
  const RoleInfo role = context.program.role(context.state.role.role);
  // Whatever goes wrong is told at the command's first line.
  Fault fault;
  SetPlace(context.program, role.commands[slot], 0, &fault);
  if (!context.program.AcceptsArguments(fault.function, arguments, count)) {
    fault.code = FaultCode::kBadInvocation;
    Report(context, fault);
    return;
  }
  // The limit is per command, so that a busy one does not shut out the others.
  int waiting = 0;
  for (int i = 0; i < s.num_pending; ++i) waiting += s.pending[i].slot == slot ? 1 : 0;
  // One that can start at once stands behind nothing.
  if (s.startup_done && FindTask(s, TaskKind::kCommand, slot) == nullptr) --waiting;
  if (waiting >= kQueueDepth || s.num_pending == kMaxPendingCommands) {
    fault.code = FaultCode::kQueueOverflow;
    fault.limit = static_cast<float>(kQueueDepth);
    Report(context, fault);
    return;
  }
  PendingCommand& command = s.pending[s.num_pending++];
  command = PendingCommand();
  command.slot = static_cast<uint8_t>(slot);
  command.num_arguments = static_cast<uint8_t>(count);
  for (int i = 0; i < count; ++i) command.arguments[i] = arguments[i];
}

void RaiseEvent(Context& context, Event event, int subject) {
  if (context.state.role.role < 0) return;
  SchedulerState& s = context.state.scheduler;
  const RoleInfo role = context.program.role(context.state.role.role);
  for (int i = 0; i < role.num_handlers; ++i) {
    if (role.handlers[i].event != event) continue;
    // Events of one connector or joint that come faster than the handler runs are one.
    s.event_subjects[i] |= 1u << subject;
  }
}

}  // namespace morphbus::vm
