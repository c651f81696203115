#include "vm/role/scheduler.h"

#include "vm/role/motion.h"
#include "vm/run/stepping.h"
#include "vm/run/task_queue.h"

namespace morphbus::vm {

namespace {

/// Starts a routine in a free task; false if there is none.
bool Launch(Context& context, TaskKind kind, int index, int function, const Cell* arguments,
            int count) {
  // Tasks have no heap: a fixed number of them is there from the start.
  for (Task& task : context.state.scheduler.tasks) {
    if (task.used) continue;
    task = Task();
    task.used = true;
    task.kind = kind;
    task.index = static_cast<uint8_t>(index);
    task.function = static_cast<uint16_t>(function);
    StartTask(context.program, function, arguments, count, &task.stack);
    return true;
  }
  return false;
}

/// Starts the behaviors that do not run: all at first, those that ended normally repeat by
/// themselves. One that faulted stays ended while the role is held.
void StartBehaviors(Context& context) {
  SchedulerState& s = context.state.scheduler;
  const RoleInfo role = context.program.role(context.state.role.role);
  for (int i = 0; i < role.num_behaviors; ++i) {
    if ((s.ended_behaviors >> i & 1) != 0) continue;
    if (FindTask(s, TaskKind::kBehavior, i) != nullptr) continue;
    if (Launch(context, TaskKind::kBehavior, i, role.behaviors[i], nullptr, 0)) continue;
    Fault fault{.code = FaultCode::kTooManyTasks, .limit = kMaxTasks};
    SetPlace(context.program, role.behaviors[i], 0, &fault);
    fault.ended_task = static_cast<int8_t>(TaskKind::kBehavior);
    fault.task_function = fault.function;
    Report(context, fault);
    // It is not tried again in every tick: the fault is told once.
    s.ended_behaviors = static_cast<uint16_t>(s.ended_behaviors | 1u << i);
  }
}

/// The oldest queued invocation of each command that is not running. Without a free task they wait.
void StartCommands(Context& context) {
  SchedulerState& s = context.state.scheduler;
  const RoleInfo role = context.program.role(context.state.role.role);
  // Those that cannot start yet keep their order.
  int kept = 0;
  for (int i = 0; i < s.num_pending; ++i) {
    const PendingCommand command = s.pending[i];
    const bool running = FindTask(s, TaskKind::kCommand, command.slot) != nullptr;
    if (!running && Launch(context, TaskKind::kCommand, command.slot, role.commands[command.slot],
                           command.arguments, command.num_arguments)) {
      continue;
    }
    s.pending[kept++] = command;
  }
  s.num_pending = static_cast<uint8_t>(kept);
}

/// Starts the handlers whose event has come and that do not run already.
void StartHandlers(Context& context) {
  SchedulerState& s = context.state.scheduler;
  const RoleInfo role = context.program.role(context.state.role.role);
  for (int i = 0; i < role.num_handlers; ++i) {
    if (s.event_subjects[i] == 0 || FindTask(s, TaskKind::kHandler, i) != nullptr) continue;
    if (!s.startup_done && !role.handlers[i].early) continue;
    // A handler may take what the event is about, a connector or a joint, and then runs for each;
    // else it runs once for all of them.
    const int lowest = __builtin_ctz(s.event_subjects[i]);
    const Cell subject = Cell::Int(lowest);
    const int function = role.handlers[i].function;
    const bool takes = context.program.function(function).num_arguments > 0;
    if (!Launch(context, TaskKind::kHandler, i, function, &subject, takes ? 1 : 0)) continue;
    s.event_subjects[i] = takes ? s.event_subjects[i] & ~(1u << lowest) : 0;
  }
}

/// Behaviors, commands and handlers, in this order; before the startups are through only handlers
/// that may.
void StartWhatIsDue(Context& context) {
  if (context.state.scheduler.startup_done) {
    StartBehaviors(context);
    StartCommands(context);
  }
  StartHandlers(context);
}

/// True if the task waits for nothing any more.
bool IsRunnable(const Context& context, const Task& task) {
  if (!task.used) return false;
  switch (task.wait) {
    case WaitKind::kNone:
      return true;
    case WaitKind::kNextTick:
      return context.state.tick > task.wake_us;
    case WaitKind::kSleep:
      return context.state.sim_time_us >= task.wake_us;
    case WaitKind::kMotion:
      return IsAtRest(context, task.wait_joint);
  }
  return false;
}

/// The next startup of the row, in the same task; after the last, behaviors and commands may begin.
void NextStartup(Context& context, Task* task) {
  const RoleInfo role = context.program.role(context.state.role.role);
  const int next = task->index + 1;
  if (next >= role.num_startups) {
    task->used = false;
    context.state.scheduler.startup_done = true;
    return;
  }
  task->index = static_cast<uint8_t>(next);
  StartTask(context.program, role.startups[next], nullptr, 0, &task->stack);
}

/// The present tick, as Task::round_tick has it.
int32_t RoundTick(const Context& context) {
  return static_cast<int32_t>(context.state.tick & 0x7fffffff);
}

/// A behavior repeats: in this tick if the round that has ended began in an earlier one, so that a
/// round of sleeps takes as long as they do. One that took no time goes on in the next tick, so
/// that an empty behavior does not use up the budget.
void NextRound(Context& context, Task* task) {
  const RoleInfo role = context.program.role(context.state.role.role);
  StartTask(context.program, role.behaviors[task->index], nullptr, 0, &task->stack);
  if (task->round_tick == RoundTick(context)) {
    task->wait = WaitKind::kNextTick;
    task->wake_us = context.state.tick;
  }
  task->round_tick = -1;
  task->budget_told = false;
}

/// What follows when a task's function has returned.
void Finish(Context& context, Task* task) {
  if (task->kind == TaskKind::kStartup) {
    NextStartup(context, task);
  } else if (task->kind == TaskKind::kBehavior) {
    NextRound(context, task);
  } else {
    task->used = false;
  }
}

/// Runs one task from where it stands; false if it used up its share.
bool RunOne(Context& context, ModuleServices& services, Task* task, int32_t* budget) {
  // The services must know which task calls, to make it wait and to find its source position.
  RoleState& role = context.state.role;
  task->wait = WaitKind::kNone;
  if (task->round_tick < 0) task->round_tick = RoundTick(context);
  services.SetRunning(task);
  const RoleContext as_role{role.role, role.fields, role.labels};
  const RunResult result =
      context.observer == nullptr
          ? RunTask(context.program, as_role, services, &task->stack, budget)
          : RunInSteps(context.program, as_role, services, task, budget, *context.observer);
  services.SetRunning(nullptr);
  // Where it stands, for those who ask what the module does.
  task->function = result.function;
  task->pc = result.pc;
  switch (result.status) {
    case RunStatus::kFinished:
      Finish(context, task);
      return true;
    case RunStatus::kWaiting:
      // The services have noted for what.
      task->budget_told = false;
      return true;
    case RunStatus::kFaulted:
      if (!services.TakeReported()) {
        Fault fault = FaultOf(context.program, result);
        SetEnded(*task, &fault);
        Report(context, fault);
      }
      // A startup that failed leaves the role without its conventions: nothing else may start.
      if (task->kind == TaskKind::kBehavior) {
        SchedulerState& s = context.state.scheduler;
        s.ended_behaviors = static_cast<uint16_t>(s.ended_behaviors | 1u << task->index);
      }
      task->used = false;
      return true;
    case RunStatus::kOutOfBudget:
      if (!task->budget_told) {
        Fault fault = FaultOf(context.program, result);
        fault.code = FaultCode::kBudget;
        fault.limit = static_cast<float>(context.program.instruction_budget());
        Report(context, fault);
      }
      task->budget_told = true;
      return false;
  }
  return true;
}

/// Tasks that could run and have not used up their share of this tick.
int CountRunnable(const Context& context, uint32_t spent) {
  int count = 0;
  for (int i = 0; i < kMaxTasks; ++i) {
    const Task& task = context.state.scheduler.tasks[i];
    if ((spent >> i & 1u) == 0 && IsRunnable(context, task)) ++count;
  }
  return count;
}

/// Raises each timer whose time has come; one that missed several goes on from now.
void RaiseTimers(Context& context) {
  SchedulerState& s = context.state.scheduler;
  const RoleInfo role = context.program.role(context.state.role.role);
  const int64_t now = context.state.sim_time_us;
  for (int i = 0; i < role.num_handlers; ++i) {
    const HandlerInfo handler = role.handlers[i];
    if (handler.event != Event::kTimer || now < s.next_timer_us[i]) continue;
    s.next_timer_us[i] += handler.period_us;
    if (s.next_timer_us[i] <= now) s.next_timer_us[i] = now + handler.period_us;
    s.event_subjects[i] |= 1u;
  }
}

}  // namespace

void StartRole(Context& context) {
  SchedulerState& s = context.state.scheduler;
  const RoleInfo role = context.program.role(context.state.role.role);
  // Timers count from when the role is taken.
  for (int i = 0; i < role.num_handlers; ++i) {
    s.next_timer_us[i] = context.state.sim_time_us + role.handlers[i].period_us;
  }
  s.startup_done = role.num_startups == 0;
  if (!s.startup_done) {
    Launch(context, TaskKind::kStartup, 0, role.startups[0], nullptr, 0);
  }
}

void EndTasks(Context& context) {
  SchedulerState& s = context.state.scheduler;
  // Nothing of the role goes on: neither what ran nor what waited to.
  for (Task& task : s.tasks) task = Task();
  for (int i = 0; i < kMaxRoutines; ++i) s.event_subjects[i] = 0;
  s.startup_done = false;
  s.num_pending = 0;
  s.next_task = 0;
  s.ended_behaviors = 0;
}

void RunTasks(Context& context, ModuleServices& services) {
  if (context.state.role.role < 0) return;
  SchedulerState& s = context.state.scheduler;
  RaiseTimers(context);
  // Rounds over all tasks, until none can run or the budget of the tick is gone. What starts others
  // (a startup that ends, a command) is looked at before each round.
  auto remaining = static_cast<int32_t>(context.program.instruction_budget());
  uint32_t spent = 0;  // Tasks that used up their share of this tick.
  const int begin = s.next_task;
  bool ran = true;
  while (ran && remaining > 0) {
    ran = false;
    StartWhatIsDue(context);
    for (int k = 0; k < kMaxTasks && remaining > 0; ++k) {
      const int i = (begin + k) % kMaxTasks;
      Task& task = s.tasks[i];
      if ((spent >> i & 1u) != 0 || !IsRunnable(context, task)) continue;
      // An equal share of what is left, so that a runaway loop starves no other task.
      const int32_t share = remaining / CountRunnable(context, spent);
      int32_t budget = share;
      if (!RunOne(context, services, &task, &budget)) {
        spent |= 1u << i;
        s.next_task = static_cast<uint8_t>((i + 1) % kMaxTasks);
      }
      remaining -= share - budget;
      ran = true;
    }
  }
}

void FillTasks(const Context& context, StatusReport* status) {
  const SchedulerState& s = context.state.scheduler;
  bool starting = false;
  status->num_tasks = 0;
  for (const Task& task : s.tasks) {
    if (!task.used) continue;
    starting = starting || task.kind == TaskKind::kStartup;
    // Its function and line are those of its last stop.
    TaskReport& report = status->tasks[status->num_tasks++];
    report.kind = task.kind;
    report.function = task.function;
    report.pc = static_cast<uint16_t>(task.pc);
    report.line = static_cast<uint16_t>(context.program.LineOf(task.function, task.pc));
  }
  status->ended_behaviors = static_cast<uint8_t>(__builtin_popcount(s.ended_behaviors));
  // The startups are one task, which is there until the last has returned.
  status->startup_ended = context.state.role.role >= 0 && !s.startup_done && !starting;
}

}  // namespace morphbus::vm
