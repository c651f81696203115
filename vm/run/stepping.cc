#include "vm/run/stepping.h"

#include "vm/image/opcodes.h"

namespace morphbus::vm {
namespace {

constexpr bool EveryInstructionCosts() {
  for (const OpcodeInfo& info : kOpcodes) {
    if (info.cost == 0) return false;
  }
  return true;
}
// Otherwise an instruction that costs nothing would run together with the one before it.
static_assert(EveryInstructionCosts());

/// What the instruction costs at which the task stands.
int32_t CostOfNext(const VerifiedProgram& program, const TaskState& stack) {
  const Frame& frame = stack.frames[stack.depth - 1];
  return kOpcodes[program.bytes()[program.function(frame.function).code_begin + frame.pc]].cost;
}

}  // namespace

RunResult RunInSteps(const VerifiedProgram& program, const RoleContext& role, ProgramHost& host,
                     Task* task, int32_t* budget, StepObserver& observer) {
  RunResult result;
  do {
    // With what one instruction costs RunTask runs this one, and then has not enough for the next.
    const int32_t cost = CostOfNext(program, task->stack);
    const bool affordable = cost <= *budget;
    if (affordable) observer.BeforeInstruction(*task);
    int32_t left = affordable ? cost : *budget;
    const int32_t given = left;
    result = RunTask(program, role, host, &task->stack, &left);
    // What the step has taken from what it was given, so that the budget ends as without steps.
    *budget -= given - left;
    if (!affordable) break;
  } while (result.status == RunStatus::kOutOfBudget);
  observer.AfterRun(*task, result);
  return result;
}

}  // namespace morphbus::vm
