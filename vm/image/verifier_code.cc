// One pass over each function's instructions. The image states the stack's types and the set locals
// at every target of a jump, so no edge has to be followed and nothing has to be remembered.
#include "vm/image/image.h"
#include "vm/image/opcodes.h"
#include "vm/image/verifier.h"

namespace morphbus::vm {

using image::ReadU16;
using image::ReadU32;
using image::Section;
using image::SectionOf;
using image::SectionRange;

// Walks one function from its first instruction to its last. Joins are met in the order of the
// code; *next_join is the first that lies in this function or behind it.
bool Verifier::CheckCode(int index, uint32_t* next_join) {
  const FunctionInfo info = out_.function(index);
  FunctionFacts& facts = facts_[index];
  const SectionRange joins = SectionOf(bytes_, Section::kJoins);
  const uint32_t begin = info.code_begin - out_.code_begin_;
  // At the beginning the stack is empty, and of the locals only the arguments are set.
  StackState state;
  state.set_locals = static_cast<uint16_t>((1u << info.num_arguments) - 1);
  bool reachable = true;
  uint32_t pc = 0;
  while (pc < info.code_size) {
    at_ = info.code_begin + pc;
    // At a join, what comes from above must fit what the image states; then the statement holds.
    if (*next_join < joins.count) {
      const uint32_t join = joins.begin + *next_join * image::kJoinBytes;
      const uint32_t join_at = ReadU16(bytes_ + join);
      if (join_at < begin + pc) return Fail("jump into an instruction", join);
      if (join_at == begin + pc) {
        if (reachable && !LeadsTo(join, state)) return false;
        LoadJoin(join, &state);
        reachable = true;
        ++*next_join;
      }
    }
    // The instruction itself must be known, be there as a whole, and find its operands.
    if (!reachable) return Fail("unreachable instruction", at_);
    const uint8_t op = bytes_[at_];
    if (op >= kNumOpcodes) return Fail("unknown instruction", at_);
    const OpcodeInfo& row = kOpcodes[op];
    const uint32_t length = 1 + OperandBytes(row.operand);
    if (length > info.code_size - pc) return Fail("instruction is cut off", at_);
    if (!CheckInstruction(index, info, bytes_ + at_, &state)) return false;
    // What the function needs and may do is noted on the way.
    if (state.depth > facts.max_stack) facts.max_stack = static_cast<uint8_t>(state.depth);
    if (static_cast<uint8_t>(row.effect) > facts.effect) {
      facts.effect = static_cast<uint8_t>(row.effect) & 0xf;
    }
    reachable = !row.ends();
    pc += length;
  }
  // Nothing runs on behind the last instruction. A join that lies in it shows at the next one.
  return !reachable || Fail("function runs past its end", info.code_begin + info.code_size);
}

// The table says what the instruction takes, leaves, and where it goes on.
bool Verifier::CheckInstruction(int index, const FunctionInfo& function, const uint8_t* code,
                                StackState* state) {
  const OpcodeInfo& info = kOpcodes[code[0]];
  Named named;
  if (!CheckOperand(index, function, info.operand, code + 1, state, &named)) return false;
  // A function returns what it promises, and leaves nothing on the stack.
  const bool returns = info.flow == Flow::kReturn;
  if (returns && (info.pops.size() != 0) != (function.return_type != ValueType::kVoid)) {
    return Fail("return does not fit", at_);
  }
  if (!Take(function, info, &named, state) || !Leave(info, named, state)) return false;
  if (returns) return state->depth == 0 || Fail("values left on the stack at return", at_);
  if (info.flow == Flow::kNext) return true;
  if (!LeadsTo(named.number, *state)) return false;
  if (info.flow == Flow::kKeep) state->depth -= info.pushes.size();
  return true;
}

// Joins are sorted, so that of a target is found by halving.
bool Verifier::FindJoin(const FunctionInfo& function, uint32_t target, uint32_t* join) {
  const SectionRange joins = SectionOf(bytes_, Section::kJoins);
  const auto place = [&](uint32_t i) { return joins.begin + i * image::kJoinBytes; };
  const uint32_t wanted = function.code_begin - out_.code_begin_ + target;
  const uint32_t at =
      image::FirstNot(joins.count, [&](uint32_t i) { return ReadU16(bytes_ + place(i)) < wanted; });
  *join = place(at);
  return (target < function.code_size && at != joins.count && ReadU16(bytes_ + *join) == wanted) ||
         Fail("target of a jump is not among the joins", at_);
}

// Both loops and forward jumps: the state that arrives must be the one that the join states, with
// at least its set locals.
bool Verifier::LeadsTo(uint32_t join, const StackState& state) {
  // A join may promise less than what arrives, never more.
  const uint32_t at = StateOf(join);
  const uint16_t set_locals = ReadU16(bytes_ + at);
  const uint32_t types = ReadU32(bytes_ + at + 2);
  if ((set_locals & ~state.set_locals) != 0) {
    return Fail("local is not set on every way to a join", at_);
  }
  if (state.depth > image::kMaxJoinDepth) return Fail("stack too deep at a join", at_);
  for (int i = 0; i < image::kMaxJoinDepth; ++i) {
    const auto expected = static_cast<ValueType>(types >> (4 * i) & 15);
    if ((i < state.depth ? state.types[i] : ValueType::kVoid) != expected) {
      return Fail("stack differs at a join", at_);
    }
  }
  return true;
}

// Joins that state the same share a record.
uint32_t Verifier::StateOf(uint32_t join) const {
  return SectionOf(bytes_, Section::kStates).begin +
         ReadU16(bytes_ + join + 2) * image::kStateBytes;
}

// From here on the state is the one that the join states.
void Verifier::LoadJoin(uint32_t join, StackState* state) const {
  const uint32_t at = StateOf(join);
  state->set_locals = ReadU16(bytes_ + at);
  const uint32_t types = ReadU32(bytes_ + at + 2);
  state->depth = 0;
  while (state->depth < image::kMaxJoinDepth && (types >> (4 * state->depth) & 15) != 0) {
    state->types[state->depth] = static_cast<ValueType>(types >> (4 * state->depth) & 15);
    ++state->depth;
  }
}

}  // namespace morphbus::vm
