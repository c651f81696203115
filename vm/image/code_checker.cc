#include "vm/image/code_checker.h"

#include "vm/image/opcodes.h"
#include "vm/image/stack_effect.h"

namespace morphbus::vm {

bool CodeChecker::Check(int index, CodeFacts* facts) {
  const FunctionInfo info = program_.function(index);
  OperandChecker operands(program_, tree_, joins_, info, facts);
  // The instructions are gone through once and in their order: what holds at a join the image says,
  // so that no loop needs a second pass.
  CodeState state = CodeState::AtBegin(info.num_arguments);
  bool reachable = true;
  const uint32_t end = info.code_begin + info.code_size;
  for (uint32_t at = info.code_begin; at < end;) {
    if (!MeetJoin(at, &reachable, &state)) return false;
    // The instruction itself must be known, be there as a whole, and find its operands.
    if (!reachable) return error_.Fail("unreachable instruction", at);
    const uint8_t* code = program_.bytes() + at;
    if (*code >= kNumOpcodes) return error_.Fail("unknown instruction", at);
    if (!kHoldsAllInstructions && !IsInEveryProfile(static_cast<Opcode>(*code))) {
      return error_.Fail("this build leaves the instruction out", at);
    }
    const OpcodeInfo& row = kOpcodes[*code];
    const uint32_t length = 1 + OperandBytes(row.operand);
    if (length > end - at) return error_.Fail("instruction is cut off", at);
    if (const char* problem = CheckInstruction(info, code, &operands, &state)) {
      return error_.Fail(problem, at);
    }
    // What the function needs and may do is noted on the way.
    if (state.depth > facts->max_stack) facts->max_stack = static_cast<uint8_t>(state.depth);
    const auto effect = static_cast<uint8_t>(row.effect);
    if (effect > facts->effect) facts->effect = effect;
    reachable = !row.ends();
    at += length;
  }
  // Nothing runs on behind the last instruction. A join that lies in it shows at the next one.
  return !reachable || error_.Fail("function runs past its end", end);
}

// At a join, what comes from above must fit what the image states; then the statement holds.
bool CodeChecker::MeetJoin(uint32_t at, bool* reachable, CodeState* state) {
  if (next_join_ == joins_.count()) return true;
  const uint32_t target = joins_.target(next_join_);
  if (target < at) return error_.Fail("jump into an instruction", joins_.place(next_join_));
  if (target > at) return true;
  const char* problem = *reachable ? joins_.ProblemOf(next_join_, *state) : nullptr;
  if (problem != nullptr) return error_.Fail(problem, at);
  *state = joins_.StateAt(next_join_);
  *reachable = true;
  ++next_join_;
  return true;
}

bool CodeChecker::CheckAllJoinsMet() {
  return next_join_ == joins_.count() || error_.Fail("jump outside the function", joins_.place(0));
}

// The table says what the instruction takes, leaves, and where it goes on.
const char* CodeChecker::CheckInstruction(const FunctionInfo& function, const uint8_t* code,
                                          OperandChecker* operands, CodeState* state) const {
  // Operands come first: some of them say what the instruction takes.
  const OpcodeInfo& info = kOpcodes[code[0]];
  NamedOperand named;
  if (const char* problem = operands->Check(info.operand, code + 1, state, &named)) return problem;
  // A function returns what it promises, and leaves nothing on the stack.
  const bool returns = info.flow == Flow::kReturn;
  if (returns && (info.pops.size() != 0) != (function.return_type != ValueType::kVoid)) {
    return Reason("return does not fit");
  }
  StackEffect effect(program_, function, info, named);
  if (const char* problem = effect.Take(state)) return problem;
  if (const char* problem = effect.Leave(state)) return problem;
  if (returns) return state->depth == 0 ? nullptr : Reason("values left on the stack at return");
  if (info.flow == Flow::kNext) return nullptr;
  // The rest may jump, and must bring to the target what is stated there.
  if (const char* problem = joins_.ProblemOf(named.number, *state)) return problem;
  // What such an instruction pushes is there at the target only.
  if (info.flow == Flow::kKeep) state->depth -= info.pushes.size();
  return nullptr;
}

}  // namespace morphbus::vm
