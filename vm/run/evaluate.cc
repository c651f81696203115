// Tasks from their beginning, and functions that run to their end at once.
#include <cstring>

#include "vm/image/opcodes.h"
#include "vm/run/interpreter.h"

namespace morphbus::vm {

namespace {

/// The comparison that an instruction makes, perhaps with a jump at once; kPop if it makes none.
Opcode ComparisonOf(Opcode op) {
  for (const JoinedJump& joined : kJoinedJumps) {
    if (joined.jump == op) return joined.comparison;
  }
  // Comparisons by themselves stand together in the table.
  return op >= Opcode::kEqual && op <= Opcode::kLessEqualFloat ? op : Opcode::kPop;
}

/// The type of the value that the instruction at `at` pushes last; `before` if it pushes none or
/// leaves that to what it calls.
ValueType TypePushed(const VerifiedProgram& program, const FunctionInfo& function,
                     const uint8_t* at, ValueType before) {
  const OpcodeInfo& info = kOpcodes[*at];
  if (info.pushes.size() == 0) return before;
  const Term last = info.pushes[info.pushes.size() - 1];
  if (last.type() != ValueType::kVoid) return last.type();
  return last.part() < 0 ? before
                         : TypeNamedBy(info.operand, last.part(), program, function, at + 1);
}

}  // namespace

void StartTask(const VerifiedProgram& program, int function, const Cell* arguments, int count,
               TaskState* task) {
  // Every byte is cleared, padding too, so that equal tasks are equal bytes.
  std::memset(static_cast<void*>(task), 0, sizeof(*task));
  // The arguments are the first locals; the others are set before they are read.
  const FunctionInfo info = program.function(function);
  for (int i = 0; i < count && i < info.num_arguments; ++i) task->cells[i] = arguments[i];
  task->top = info.num_locals;
  task->depth = 1;
  task->frames[0].function = static_cast<uint16_t>(function);
}

RunResult Evaluate(const VerifiedProgram& program, int function, const RoleContext& role,
                   ProgramHost& host, int32_t* budget) {
  // Requirements and labels need no task of their own: they never wait.
  TaskState task;
  StartTask(program, function, nullptr, 0, &task);
  RunResult result = RunTask(program, role, host, &task, budget);
  // There is no later tick in which an evaluation could go on.
  if (result.status == RunStatus::kWaiting || result.status == RunStatus::kOutOfBudget) {
    result.status = RunStatus::kFaulted;
    result.fault = FaultCode::kBudget;
  }
  return result;
}

Comparisons TraceComparisons(const VerifiedProgram& program, int function, const RoleContext& role,
                             ProgramHost& host, int32_t budget) {
  Comparisons trace;
  ValueType pushed = ValueType::kVoid;
  TaskState task;
  StartTask(program, function, nullptr, 0, &task);
  // With no more to spend than an instruction's own cost, nothing runs behind it.
  RunStatus status = RunStatus::kOutOfBudget;
  while (status == RunStatus::kOutOfBudget && budget > 0) {
    const Frame& frame = task.frames[task.depth - 1];
    const FunctionInfo running = program.function(frame.function);
    const uint8_t* at = program.bytes() + running.code_begin + frame.pc;
    const OpcodeInfo& info = kOpcodes[*at];
    const Opcode comparison = ComparisonOf(static_cast<Opcode>(*at));
    if (comparison != Opcode::kPop) {
      trace.Add({comparison, pushed, task.cells[task.top - 2], task.cells[task.top - 1]});
    }
    // Both operands are of one type, so that of the second one will do.
    pushed = TypePushed(program, running, at, pushed);
    budget -= info.cost;
    int32_t cost = info.cost;
    status = RunTask(program, role, host, &task, &cost).status;
  }
  return trace;
}

}  // namespace morphbus::vm
