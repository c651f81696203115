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

// Walks one function from its first instruction to its last.
bool Verifier::CheckCode(int index) {
  FunctionInfo& info = out_.functions_[index];
  const uint32_t record = SectionOf(bytes_, Section::kFunctions).begin +
                          static_cast<uint32_t>(index) * image::kFunctionBytes;
  // The joins tell the walk what holds at each target of a jump.
  const JoinTable joins{
      SectionOf(bytes_, Section::kJoins).begin +
          ReadU16(bytes_ + record + image::kFunctionFirstJoinAt) * image::kJoinBytes,
      ReadU16(bytes_ + record + image::kFunctionJoinsAt)};
  // At the beginning the stack is empty, and of the locals only the arguments are set.
  StackState state;
  state.set_locals = static_cast<uint16_t>((1u << info.num_arguments) - 1);
  bool reachable = true;
  int next_join = 0;
  uint32_t pc = 0;
  while (pc < info.code_size) {
    at_ = info.code_begin + pc;
    // At a join, what comes from above must fit what the image states; then the statement holds.
    if (next_join < joins.count) {
      const uint32_t join = joins.begin + static_cast<uint32_t>(next_join) * image::kJoinBytes;
      const uint32_t join_at = ReadU16(bytes_ + join);
      if (join_at < pc) return Fail("jump into an instruction", join);
      if (join_at == pc) {
        if (reachable && !LeadsTo(join, state)) return false;
        LoadJoin(join, &state);
        reachable = true;
        ++next_join;
      }
    }
    // The instruction itself must be known, be there as a whole, and find its operands.
    if (!reachable) return Fail("unreachable instruction", at_);
    const uint8_t op = bytes_[at_];
    if (op >= kNumOpcodes) return Fail("unknown instruction", at_);
    const uint32_t length = 1 + OperandBytes(kOpcodes[op].operand);
    if (length > info.code_size - pc) return Fail("instruction is cut off", at_);
    bool ends = false;
    if (!CheckInstruction(index, joins, bytes_ + at_, &state, &ends)) return false;
    // What the function needs and may do is noted on the way.
    if (state.depth > info.max_stack) info.max_stack = static_cast<uint8_t>(state.depth);
    if (static_cast<uint8_t>(kOpcodes[op].effect) > effects_[index]) {
      effects_[index] = static_cast<uint8_t>(kOpcodes[op].effect);
    }
    reachable = !ends;
    pc += length;
  }
  // Nothing runs on behind the last instruction, and every join must have been met.
  if (reachable) return Fail("function runs past its end", info.code_begin + info.code_size);
  if (next_join != joins.count) return Fail("jump outside the function", joins.begin);
  return true;
}

// Most instructions are checked by the letters of the table; those below depend on their operand or
// on what lies on the stack.
bool Verifier::CheckInstruction(int index, const JoinTable& joins, const uint8_t* code,
                                StackState* state, bool* ends) {
  const uint8_t op = code[0];
  const uint32_t operand = OperandBytes(kOpcodes[op].operand) == 2   ? ReadU16(code + 1)
                           : OperandBytes(kOpcodes[op].operand) == 1 ? code[1]
                                                                     : 0;
  switch (static_cast<Opcode>(op)) {
    case Opcode::kPushConst:
      if (operand >= out_.num_constants_) return Fail("no such constant", at_);
      return PushType(
          static_cast<ValueType>(bytes_[out_.constants_begin_ + operand * image::kConstantBytes]),
          state);
    // What an operand names must exist, and says which type is pushed or popped.
    case Opcode::kLoadLocal:
    case Opcode::kStoreLocal:
      return CheckVariable(index, op, operand, state);
    case Opcode::kLoadField:
    case Opcode::kStoreField:
    case Opcode::kLoadLabel:
    case Opcode::kKeyword:
      return CheckSlot(index, op, operand, state);
    case Opcode::kPop: {
      ValueType type;
      return PopAny(&type, state);
    }
    // Control flow: targets are joins; behind a jump or return nothing runs on.
    case Opcode::kJump:
      *ends = true;
      return CheckJump(joins, op, operand, state);
    case Opcode::kJumpIfFalse:
    case Opcode::kJumpIfTrue:
    case Opcode::kAnd:
    case Opcode::kOr:
      return CheckJump(joins, op, operand, state);
    case Opcode::kCall:
    case Opcode::kInvoke:
      return CheckCallOut(index, op, code + 1, state);
    case Opcode::kReturn:
    case Opcode::kReturnValue:
      *ends = true;
      return CheckReturn(index, op, state);
    case Opcode::kEqual:
    case Opcode::kNotEqual:
      return CheckSame(state);
    default:
      return CheckBySignature(index, op, operand, state);
  }
}

// Locals are set before they are read, on every way.
bool Verifier::CheckVariable(int index, uint8_t op, uint32_t operand, StackState* state) {
  const FunctionInfo& info = out_.functions_[index];
  if (operand >= info.num_locals) return Fail("no such local", at_);
  const auto bit = static_cast<uint16_t>(1u << operand);
  if (op == static_cast<uint8_t>(Opcode::kStoreLocal)) {
    state->set_locals |= bit;
    return PopType(info.local_types[operand], state);
  }
  if ((state->set_locals & bit) == 0) return Fail("local is read before it is set", at_);
  return PushType(info.local_types[operand], state);
}

// Fields and labels by the owner's slots, keywords by the program's table.
bool Verifier::CheckSlot(int index, uint8_t op, uint32_t operand, StackState* state) {
  const RoleInfo& role = out_.roles_[OwnerOf(index)];
  switch (static_cast<Opcode>(op)) {
    case Opcode::kLoadLabel:
      if (operand >= role.num_labels) return Fail("no such label", at_);
      return PushType(role.labels[operand].type, state);
    case Opcode::kKeyword: {
      if (operand >= static_cast<uint32_t>(out_.num_keywords_)) {
        return Fail("no such keyword", at_);
      }
      // Which keywords a function needs decides which module types can take its roles.
      keywords_used_[index] |= uint64_t{1} << operand;
      switch (out_.keywords_[operand].kind) {
        case KeywordKind::kLink:
          return PushType(ValueType::kLink, state);
        case KeywordKind::kJoint:
          return PushType(ValueType::kJoint, state);
        case KeywordKind::kConnector:
          return PushType(ValueType::kConnector, state);
        case KeywordKind::kConnectorState:
          break;
      }
      return Fail("keyword names no part", at_);
    }
    default:
      if (operand >= role.num_fields) return Fail("no such field", at_);
      return op == static_cast<uint8_t>(Opcode::kLoadField)
                 ? PushType(role.field_types[operand], state)
                 : PopType(role.field_types[operand], state);
  }
}

// The target must be a join; joins are sorted, so it is found by halving.
bool Verifier::CheckJump(const JoinTable& joins, uint8_t op, uint32_t target, StackState* state) {
  if (op != static_cast<uint8_t>(Opcode::kJump) && !PopType(ValueType::kBool, state)) {
    return false;
  }
  const auto place = [&](uint32_t i) { return joins.begin + i * image::kJoinBytes; };
  const auto count = static_cast<uint32_t>(joins.count);
  const uint32_t at =
      image::FirstNot(count, [&](uint32_t i) { return ReadU16(bytes_ + place(i)) < target; });
  const uint32_t join = place(at);
  if (at == count || ReadU16(bytes_ + join) != target) {
    return Fail("target of a jump is not among the joins", at_);
  }
  // `and` and `or` keep the bool on the way to the target only.
  const bool keeps =
      op == static_cast<uint8_t>(Opcode::kAnd) || op == static_cast<uint8_t>(Opcode::kOr);
  if (keeps && !PushType(ValueType::kBool, state)) return false;
  if (!LeadsTo(join, *state)) return false;
  return !keeps || PopType(ValueType::kBool, state);
}

// Both loops and forward jumps: the state that arrives must be the one that the join states, with
// at least its set locals.
bool Verifier::LeadsTo(uint32_t join, const StackState& state) {
  // A join may promise less than what arrives, never more.
  const uint16_t set_locals = ReadU16(bytes_ + join + 2);
  const uint32_t types = ReadU32(bytes_ + join + 4);
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

// From here on the state is the one that the join states.
void Verifier::LoadJoin(uint32_t join, StackState* state) const {
  state->set_locals = ReadU16(bytes_ + join + 2);
  const uint32_t types = ReadU32(bytes_ + join + 4);
  state->depth = 0;
  while (state->depth < image::kMaxJoinDepth && (types >> (4 * state->depth) & 15) != 0) {
    state->types[state->depth] = static_cast<ValueType>(types >> (4 * state->depth) & 15);
    ++state->depth;
  }
}

// Invocations name their role and command; calls name a slot, which each subrole fills in its way.
bool Verifier::CheckCallOut(int index, uint8_t op, const uint8_t* operand, StackState* state) {
  if (op == static_cast<uint8_t>(Opcode::kInvoke)) {
    // An invocation goes to other modules, whose command must be one of this program.
    if (operand[0] >= out_.num_roles_) return Fail("no such role", at_);
    const RoleInfo& role = out_.roles_[operand[0]];
    if (operand[1] >= role.num_commands) return Fail("no such command", at_);
    return PopArguments(role.commands[operand[1]].function, state);
  }
  const RoleInfo& role = out_.roles_[OwnerOf(index)];
  if (operand[0] >= role.num_methods) return Fail("no such function", at_);
  methods_called_[index] |= static_cast<uint16_t>(1u << operand[0]);
  const int callee = role.methods[operand[0]];
  if (!PopArguments(callee, state)) return false;
  const ValueType type = out_.functions_[callee].return_type;
  return type == ValueType::kVoid || PushType(type, state);
}

// A function returns what it promises, and leaves nothing on the stack.
bool Verifier::CheckReturn(int index, uint8_t op, StackState* state) {
  const ValueType type = out_.functions_[index].return_type;
  const bool has_value = op == static_cast<uint8_t>(Opcode::kReturnValue);
  if (has_value != (type != ValueType::kVoid)) return Fail("return does not fit", at_);
  if (has_value && !PopType(type, state)) return false;
  return state->depth == 0 || Fail("values left on the stack at return", at_);
}

// Pops and pushes what the table's letters say.
bool Verifier::CheckBySignature(int index, uint8_t op, uint32_t operand, StackState* state) {
  const OpcodeInfo& info = kOpcodes[op];
  // A connector's state is named by a keyword, which must be of that kind.
  if (info.operand == OperandKind::kKeyword) {
    if (operand >= static_cast<uint32_t>(out_.num_keywords_) ||
        out_.keywords_[operand].kind != KeywordKind::kConnectorState) {
      return Fail("keyword names no state variable", at_);
    }
    keywords_used_[index] |= uint64_t{1} << operand;
  }
  // The last letter is the top of the stack.
  int pops = 0;
  while (info.pops[pops] != '\0') ++pops;
  for (int i = pops - 1; i >= 0; --i) {
    if (!PopType(TypeOfLetter(info.pops[i]), state)) return false;
  }
  return info.pushes[0] == '\0' || PushType(TypeOfLetter(info.pushes[0]), state);
}

// Floats are compared by an instruction of their own, and sets not at all.
bool Verifier::CheckSame(StackState* state) {
  ValueType second{}, first{};
  if (!PopAny(&second, state) || !PopAny(&first, state)) return false;
  const bool comparable = first == ValueType::kBool || first == ValueType::kInt ||
                          (first >= ValueType::kDirection && first <= ValueType::kLink);
  if (first != second || !comparable) return Fail("values cannot be compared", at_);
  return PushType(ValueType::kBool, state);
}

// Steps of the abstract stack.
bool Verifier::PopAny(ValueType* type, StackState* state) {
  if (state->depth == 0) return Fail("stack underflow", at_);
  *type = state->types[--state->depth];
  return true;
}

bool Verifier::PopType(ValueType type, StackState* state) {
  ValueType found{};
  if (!PopAny(&found, state)) return false;
  return found == type || Fail("operand of the wrong type", at_);
}

bool Verifier::PushType(ValueType type, StackState* state) {
  if (state->depth >= kStackCells) return Fail("stack overflow", at_);
  state->types[state->depth++] = type;
  return true;
}

bool Verifier::PopArguments(int function, StackState* state) {
  const FunctionInfo& info = out_.functions_[function];
  for (int i = info.num_arguments - 1; i >= 0; --i) {
    if (!PopType(info.local_types[i], state)) return false;
  }
  return true;
}

// Calls go through the role's slots, so a call may reach the function of any subrole. No recursion
// can be, and the depth and cells that any task can need are bounded here, once.
bool Verifier::CheckCalls() {
  for (int i = 0; i < out_.num_functions_; ++i) {
    if (!VisitCalls(i, 0)) return false;
  }
  // With every function visited, the keywords of each role are known.
  for (int i = 0; i < out_.num_roles_; ++i) CollectKeywords(i);
  return true;
}

// Depth is at most kMaxCallDepth, so this recursion is short; every function is visited once.
bool Verifier::VisitCalls(int function, int depth) {
  FunctionInfo& info = out_.functions_[function];
  at_ = info.code_begin;
  if (visits_[function] == 1) return Fail("functions call each other in a circle", at_);
  if (depth >= kMaxCallDepth) return Fail("calls nest too deep", at_);
  if (visits_[function] == 2) return true;
  // While it is being visited, meeting it again means a circle.
  visits_[function] = 1;
  info.call_depth = 0;
  info.total_cells = 0;
  for (int slot = 0; slot < kMaxRoutines; ++slot) {
    if ((methods_called_[function] >> slot & 1) != 0 && !VisitCallees(function, slot, depth)) {
      return false;
    }
  }
  // The callee's frame begins at its arguments; counting them twice is simple and safe.
  info.total_cells = static_cast<uint16_t>(info.total_cells + info.num_locals + info.max_stack);
  at_ = info.code_begin;
  if (info.call_depth >= kMaxCallDepth) return Fail("calls nest too deep", at_);
  if (info.total_cells > kStackCells) return Fail("task needs too many cells", at_);
  visits_[function] = 2;
  return true;
}

// A call by a slot may reach the function of the owner or of any role that extends it.
bool Verifier::VisitCallees(int function, int slot, int depth) {
  FunctionInfo& info = out_.functions_[function];
  const int owner = OwnerOf(function);
  for (int role = 0; role < out_.num_roles_; ++role) {
    if ((ancestors_[role] >> owner & 1) == 0) continue;
    const int callee = out_.roles_[role].methods[slot];
    if (!VisitCalls(callee, depth + 1)) return false;
    // The deepest, largest and strongest of all that may be called counts.
    const FunctionInfo& called = out_.functions_[callee];
    if (called.call_depth + 1 > info.call_depth) {
      info.call_depth = static_cast<uint8_t>(called.call_depth + 1);
    }
    if (called.total_cells > info.total_cells) info.total_cells = called.total_cells;
    if (effects_[callee] > effects_[function]) effects_[function] = effects_[callee];
  }
  return true;
}

// Requirements and labels are evaluated whenever the surroundings change, so they must not act.
bool Verifier::CheckEffects() {
  bool pure = true;
  const auto check = [&](int function) {
    pure = pure && effects_[function] == static_cast<uint8_t>(Effect::kPure);
  };
  for (int i = 0; i < out_.num_roles_; ++i) {
    const RoleInfo& role = out_.roles_[i];
    for (int k = 0; k < role.num_requirements; ++k) check(role.requirements[k]);
    for (int k = 0; k < role.num_labels; ++k) check(role.labels[k].function);
  }
  return pure ||
         Fail("requirement or label acts on the module", SectionOf(bytes_, Section::kRoles).begin);
}

}  // namespace morphbus::vm
