#include "vm/image/join_table.h"

namespace morphbus::vm {

using image::ReadU16;
using image::ReadU32;
using image::Section;
using image::SectionOf;
using image::SectionRange;

namespace {

/// The type in place i of a state's stack.
constexpr uint32_t TypeIn(uint32_t stack_types, int i) { return stack_types >> (4 * i) & 15; }

}  // namespace

JoinTable::JoinTable(const uint8_t* image)
    : image_(image),
      joins_(SectionOf(image, Section::kJoins)),
      states_begin_(SectionOf(image, Section::kStates).begin),
      code_begin_(SectionOf(image, Section::kCode).begin) {}

uint32_t JoinTable::FirstFrom(uint32_t byte) const {
  // Joins are sorted, so that the first one is found by halving.
  return image::FirstNot(joins_.count, [&](uint32_t i) { return target(i) < byte; });
}

const uint8_t* JoinTable::StateOf(uint32_t i) const {
  return image_ + states_begin_ + ReadU16(image_ + place(i) + 2) * image::kStateBytes;
}

// The first type that is none lies above the top.
CodeState JoinTable::StateAt(uint32_t i) const {
  // The stack's types are packed, four bits each, from the bottom up.
  CodeState state;
  state.set_locals = set_locals(i);
  const uint32_t types = stack_types(i);
  while (state.depth < image::kMaxJoinDepth && TypeIn(types, state.depth) != 0) {
    state.types[state.depth] = static_cast<ValueType>(TypeIn(types, state.depth));
    ++state.depth;
  }
  return state;
}

// Loops and forward jumps alike: the statement must hold whichever way is taken, so it may promise
// no more than each of them brings.
const char* JoinTable::ProblemOf(uint32_t i, const CodeState& arriving) const {
  // A local that some way leaves without a value may not be read behind the join.
  if ((set_locals(i) & ~arriving.set_locals) != 0) {
    return Reason("local is not set on every way to a join");
  }
  if (arriving.depth > image::kMaxJoinDepth) return Reason("stack too deep at a join");
  // Both stacks must be alike up to their tops, type by type.
  const uint32_t types = stack_types(i);
  for (int k = 0; k < image::kMaxJoinDepth; ++k) {
    const ValueType found = k < arriving.depth ? arriving.types[k] : ValueType::kVoid;
    if (static_cast<uint32_t>(found) != TypeIn(types, k)) return Reason("stack differs at a join");
  }
  return nullptr;
}

bool CheckJoins(const VerifiedProgram& program, FirstError* error) {
  const uint8_t* bytes = program.bytes();
  const SectionRange states = SectionOf(bytes, Section::kStates);
  for (uint32_t i = 0; i < states.count; ++i) {
    const uint32_t at = states.begin + i * image::kStateBytes;
    // Types lie from the bottom of the stack up; above its top there are none.
    bool above_top = false;
    for (int k = 0; k < image::kMaxJoinDepth; ++k) {
      const uint32_t type = TypeIn(ReadU32(bytes + at + 2), k);
      if (type >= kNumValueTypes || (above_top && type != 0)) {
        return error->Fail("bad stack types of a join", at);
      }
      above_top = above_top || type == 0;
    }
  }
  // The joins are what states are there for: each names one, and they rise.
  const JoinTable joins(bytes);
  for (uint32_t i = 0; i < joins.count(); ++i) {
    const uint32_t at = joins.place(i);
    if (ReadU16(bytes + at + 2) >= states.count) return error->Fail("join of no state", at);
    if (i > 0 && joins.target(i) <= joins.target(i - 1)) {
      return error->Fail("joins are not sorted", at);
    }
  }
  return true;
}

}  // namespace morphbus::vm
