#pragma once
// Lets an observer look on while tasks run, instruction by instruction. Only tools on the host do:
// a module's own process runs without.

#include "vm/run/interpreter.h"
#include "vm/run/state.h"

namespace morphbus::vm {

/// Looks on. What it is shown is the VM's own; it lives until the call returns.
class StepObserver {
 public:
  /// The instruction at which the innermost call of the task stands runs next. Its locals and
  /// operands lie on the task's stack.
  virtual void BeforeInstruction(const Task& task) = 0;
  /// The run of the task has ended so; what it waits for, if it waits, is noted in the task.
  virtual void AfterRun(const Task& task, const RunResult& result) = 0;

 protected:
  ~StepObserver() = default;
};

/// Does what RunTask does, to the bit, and shows `observer` every instruction before it runs.
RunResult RunInSteps(const VerifiedProgram& program, const RoleContext& role, ProgramHost& host,
                     Task* task, int32_t* budget, StepObserver& observer);

}  // namespace morphbus::vm
