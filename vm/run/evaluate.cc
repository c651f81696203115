// Tasks from their beginning, and functions that run to their end at once.
#include <cstring>

#include "vm/image/image.h"
#include "vm/image/opcodes.h"
#include "vm/run/interpreter.h"

namespace morphbus::vm {

namespace {

/// The comparison that an instruction makes, perhaps with a jump at once; kPop if it makes none.
Opcode ComparisonOf(Opcode op) {
  if (op >= Opcode::kEqual && op <= Opcode::kLessEqualFloat) return op;
  switch (op) {
    case Opcode::kJumpUnlessEqual:
      return Opcode::kEqual;
    case Opcode::kJumpUnlessNotEqual:
      return Opcode::kNotEqual;
    case Opcode::kJumpUnlessLessInt:
    case Opcode::kJumpIfLessInt:
      return Opcode::kLessInt;
    case Opcode::kJumpUnlessLessEqualInt:
    case Opcode::kJumpIfLessEqualInt:
      return Opcode::kLessEqualInt;
    default:
      return Opcode::kPop;
  }
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
    const uint8_t* at = program.bytes() + program.function(frame.function).code_begin + frame.pc;
    const OpcodeInfo& info = kOpcodes[*at];
    const auto op = static_cast<Opcode>(*at);
    const Opcode comparison = ComparisonOf(op);
    if (comparison != Opcode::kPop) {
      trace.Add({comparison, pushed, task.cells[task.top - 2], task.cells[task.top - 1]});
    }
    // Both operands are of one type, so that of the second one will do.
    if (op == Opcode::kPushConst) {
      pushed = program.constant_type(image::ReadU16(at + 1));
    } else if (op == Opcode::kLoadField) {
      pushed = program.role(role.role).fields.type(at[1]);
    } else if (info.pushes[0] != '\0' && info.pushes[0] != '*') {
      pushed = TypeOfLetter(info.pushes[0]);
    }
    budget -= info.cost;
    int32_t cost = info.cost;
    status = RunTask(program, role, host, &task, &cost).status;
  }
  return trace;
}

}  // namespace morphbus::vm
