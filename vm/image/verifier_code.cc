// One pass over each function's instructions. The image states the stack's types and the set locals
// at every target of a jump, so no edge has to be followed and nothing has to be remembered.
#include "vm/image/image.h"
#include "vm/image/opcodes.h"
#include "vm/image/print_text.h"
#include "vm/image/verifier.h"

namespace morphbus::vm {

namespace {

/// The kind of keyword that an instruction takes which has one and does not push it.
KeywordKind KeywordKindOf(Opcode op) {
  switch (op) {
    case Opcode::kDistance:
    case Opcode::kContact:
    case Opcode::kTilt:
      return KeywordKind::kSensorKind;
    case Opcode::kGetDistance:
    case Opcode::kGetContact:
    case Opcode::kGetTilt:
      return KeywordKind::kSensor;
    default:
      return KeywordKind::kConnectorState;
  }
}

}  // namespace

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
    const uint32_t length = 1 + OperandBytes(kOpcodes[op].operand);
    if (length > info.code_size - pc) return Fail("instruction is cut off", at_);
    bool ends = false;
    if (!CheckInstruction(index, bytes_ + at_, &state, &ends)) return false;
    // What the function needs and may do is noted on the way.
    if (state.depth > facts.max_stack) facts.max_stack = static_cast<uint8_t>(state.depth);
    if (static_cast<uint8_t>(kOpcodes[op].effect) > facts.effect) {
      facts.effect = static_cast<uint8_t>(kOpcodes[op].effect) & 0xf;
    }
    reachable = !ends;
    pc += length;
  }
  // Nothing runs on behind the last instruction. A join that lies in it shows at the next one.
  return !reachable || Fail("function runs past its end", info.code_begin + info.code_size);
}

// Most instructions are checked by the letters of the table; those below depend on their operand or
// on what lies on the stack.
bool Verifier::CheckInstruction(int index, const uint8_t* code, StackState* state, bool* ends) {
  const uint8_t op = code[0];
  const uint32_t operand = OperandBytes(kOpcodes[op].operand) == 2   ? ReadU16(code + 1)
                           : OperandBytes(kOpcodes[op].operand) == 1 ? code[1]
                                                                     : 0;
  switch (static_cast<Opcode>(op)) {
    case Opcode::kPushConst:
      if (operand >= out_.num_constants_) return Fail("no such constant", at_);
      if (out_.constant_type(static_cast<int>(operand)) == ValueType::kText) {
        return Fail("a text is no value", at_);
      }
      return PushType(
          static_cast<ValueType>(bytes_[out_.constants_begin_ + operand * image::kConstantBytes]),
          state);
    // What an operand names must exist, and says which type is pushed or popped.
    case Opcode::kLoadLocal:
      return LoadLocal(index, operand, state);
    case Opcode::kStoreLocal:
      return StoreLocal(index, operand, state);
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
      return CheckJump(index, op, operand, state);
    case Opcode::kJumpIfFalse:
    case Opcode::kJumpIfTrue:
    case Opcode::kAnd:
    case Opcode::kOr:
      return CheckJump(index, op, operand, state);
    // A comparison and a jump at once.
    case Opcode::kJumpUnlessEqual:
    case Opcode::kJumpUnlessNotEqual:
      return CheckSame(state) && CheckJump(index, op, operand, state);
    case Opcode::kJumpUnlessLessInt:
    case Opcode::kJumpUnlessLessEqualInt:
    case Opcode::kJumpIfLessInt:
    case Opcode::kJumpIfLessEqualInt:
      return PopType(ValueType::kInt, state) && PopType(ValueType::kInt, state) &&
             PushType(ValueType::kBool, state) && CheckJump(index, op, operand, state);
    // Locals that are operands of arithmetic.
    case Opcode::kLoadLocals:
      return LoadLocal(index, code[1], state) && LoadLocal(index, code[2], state);
    case Opcode::kAddLocalInt:
      return PopType(ValueType::kInt, state) && LoadLocal(index, code[1], state) &&
             PopType(ValueType::kInt, state) && PushType(ValueType::kInt, state);
    case Opcode::kAddToLocal:
      return LoadLocal(index, code[1], state) && PopType(ValueType::kInt, state);
    case Opcode::kModConst:
      return CheckIntConstant(operand) && CheckBySignature(index, op, operand, state);
    case Opcode::kJumpIfLocalLess:
      // As a local on the stack, and the bool of a comparison in its place.
      return CheckIntConstant(ReadU16(code + 2)) && LoadLocal(index, code[1], state) &&
             PopType(ValueType::kInt, state) && PushType(ValueType::kBool, state) &&
             CheckJump(index, op, ReadU16(code + 4), state);
    case Opcode::kCall:
    case Opcode::kInvoke:
      return CheckCallOut(index, op, code + 1, state);
    case Opcode::kNeighbourField:
    case Opcode::kInvokeNear:
      return CheckNeighbour(op, code + 1, state);
    case Opcode::kPrint:
      return CheckPrint(operand, state);
    case Opcode::kCallSuper:
      return CheckSuper(index, operand, state);
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

bool Verifier::CheckIntConstant(uint32_t constant) {
  if (constant < out_.num_constants_ &&
      out_.constant_type(static_cast<int>(constant)) == ValueType::kInt) {
    return true;
  }
  return Fail("no such constant", at_);
}

// Locals are set before they are read, on every way.
bool Verifier::LoadLocal(int index, uint32_t local, StackState* state) {
  const FunctionInfo info = out_.function(index);
  if (local >= info.num_locals) return Fail("no such local", at_);
  if ((state->set_locals >> local & 1) == 0) return Fail("local is read before it is set", at_);
  return PushType(info.local_types[static_cast<int>(local)], state);
}

bool Verifier::StoreLocal(int index, uint32_t local, StackState* state) {
  const FunctionInfo info = out_.function(index);
  if (local >= info.num_locals) return Fail("no such local", at_);
  state->set_locals = static_cast<uint16_t>(state->set_locals | 1u << local);
  return PopType(info.local_types[static_cast<int>(local)], state);
}

// Fields and labels by the owner's slots, keywords by the program's table.
bool Verifier::CheckSlot(int index, uint8_t op, uint32_t operand, StackState* state) {
  const RoleInfo role = out_.role(OwnerOf(index));
  switch (static_cast<Opcode>(op)) {
    case Opcode::kLoadLabel:
      if (operand >= role.num_labels) return Fail("no such label", at_);
      return PushType(out_.function(role.labels[static_cast<int>(operand)]).return_type, state);
    case Opcode::kKeyword: {
      if (operand >= static_cast<uint32_t>(out_.num_keywords_)) {
        return Fail("no such keyword", at_);
      }
      // Which keywords a function needs decides which module types can take its roles.
      facts_[index].keywords |= uint64_t{1} << operand;
      switch (out_.keyword(static_cast<int>(operand)).kind) {
        case KeywordKind::kLink:
          return PushType(ValueType::kLink, state);
        case KeywordKind::kJoint:
          return PushType(ValueType::kJoint, state);
        case KeywordKind::kConnector:
          return PushType(ValueType::kConnector, state);
        case KeywordKind::kConnectorState:
        case KeywordKind::kSensor:
        case KeywordKind::kSensorKind:
          break;
      }
      return Fail("keyword names no part", at_);
    }
    default:
      if (operand >= role.num_fields) return Fail("no such field", at_);
      return op == static_cast<uint8_t>(Opcode::kLoadField)
                 ? PushType(role.fields.type(static_cast<int>(operand)), state)
                 : PopType(role.fields.type(static_cast<int>(operand)), state);
  }
}

// The target must be a join; joins are sorted, so it is found by halving.
bool Verifier::CheckJump(int index, uint8_t op, uint32_t target, StackState* state) {
  if (op != static_cast<uint8_t>(Opcode::kJump) && !PopType(ValueType::kBool, state)) {
    return false;
  }
  const FunctionInfo info = out_.function(index);
  const SectionRange joins = SectionOf(bytes_, Section::kJoins);
  const auto place = [&](uint32_t i) { return joins.begin + i * image::kJoinBytes; };
  const uint32_t wanted = info.code_begin - out_.code_begin_ + target;
  const uint32_t at =
      image::FirstNot(joins.count, [&](uint32_t i) { return ReadU16(bytes_ + place(i)) < wanted; });
  const uint32_t join = place(at);
  if (target >= info.code_size || at == joins.count || ReadU16(bytes_ + join) != wanted) {
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

// Invocations name their role and command; calls name a slot, which each subrole fills in its way.
bool Verifier::CheckCallOut(int index, uint8_t op, const uint8_t* operand, StackState* state) {
  if (op == static_cast<uint8_t>(Opcode::kInvoke)) {
    // An invocation goes to other modules, whose command must be one of this program.
    if (operand[0] >= out_.num_roles_) return Fail("no such role", at_);
    const RoleInfo role = out_.role(operand[0]);
    if (operand[1] >= role.num_commands) return Fail("no such command", at_);
    return PopArguments(role.commands[operand[1]], state);
  }
  const RoleInfo role = out_.role(OwnerOf(index));
  if (operand[0] >= role.num_methods) return Fail("no such function", at_);
  facts_[index].methods_called |= static_cast<uint16_t>(1u << operand[0]);
  const int callee = role.methods[operand[0]];
  if (!PopArguments(callee, state)) return false;
  const ValueType type = out_.function(static_cast<int>(callee)).return_type;
  return type == ValueType::kVoid || PushType(type, state);
}

// Fields and commands of neighbours, which lie in a set below the arguments.
bool Verifier::CheckNeighbour(uint8_t op, const uint8_t* operand, StackState* state) {
  if (operand[0] >= out_.num_roles_) return Fail("no such role", at_);
  const RoleInfo role = out_.role(operand[0]);
  if (op == static_cast<uint8_t>(Opcode::kInvokeNear)) {
    if (operand[1] >= role.num_commands) return Fail("no such command", at_);
    return PopArguments(role.commands[operand[1]], state) && PopType(ValueType::kSet, state);
  }
  if (operand[1] >= role.num_fields || !role.fields.shared(operand[1])) {
    return Fail("no such shared field", at_);
  }
  return PopType(ValueType::kSet, state) && PushType(role.fields.type(operand[1]), state);
}

// A text takes the values that it has places for; the last one is the top of the stack.
bool Verifier::CheckPrint(uint32_t constant, StackState* state) {
  if (constant >= out_.num_constants_ ||
      out_.constant_type(static_cast<int>(constant)) != ValueType::kText) {
    return Fail("no such text", at_);
  }
  PrintPlaces places;
  FindPlaces(out_.text(static_cast<int>(constant)), &places);
  for (int i = places.count - 1; i >= 0; --i) {
    if (!PopType(places.types[i], state)) return false;
  }
  return true;
}

// A member that replaces an inherited one may call it. Its slots are those of a role that the own
// one extends; so a role that uses the caller has them, too.
bool Verifier::CheckSuper(int index, uint32_t callee, StackState* state) {
  if (callee >= static_cast<uint32_t>(out_.num_functions_)) return Fail("no such function", at_);
  const int owner = OwnerOf(index);
  const int above = OwnerOf(static_cast<int>(callee));
  if (owner == above || (ancestors_[owner] >> above & 1) == 0) {
    return Fail("function of a role that the own one does not extend", at_);
  }
  // A member replaces one other; so the calls of a function are found in one step.
  uint16_t& super_called = facts_[index].super_called;
  if (super_called != 0 && super_called != callee + 1) {
    return Fail("function calls two that it replaces", at_);
  }
  super_called = static_cast<uint16_t>(callee + 1);
  if (!PopArguments(static_cast<int>(callee), state)) return false;
  const ValueType type = out_.function(static_cast<int>(callee)).return_type;
  return type == ValueType::kVoid || PushType(type, state);
}

// A function returns what it promises, and leaves nothing on the stack.
bool Verifier::CheckReturn(int index, uint8_t op, StackState* state) {
  const ValueType type = out_.function(index).return_type;
  const bool has_value = op == static_cast<uint8_t>(Opcode::kReturnValue);
  if (has_value != (type != ValueType::kVoid)) return Fail("return does not fit", at_);
  if (has_value && !PopType(type, state)) return false;
  return state->depth == 0 || Fail("values left on the stack at return", at_);
}

// Pops and pushes what the table's letters say.
bool Verifier::CheckBySignature(int index, uint8_t op, uint32_t operand, StackState* state) {
  const OpcodeInfo& info = kOpcodes[op];
  // What is not pushed but used by the instruction is named by a keyword of the kind that it takes.
  if (info.operand == OperandKind::kKeyword) {
    const KeywordKind wanted = KeywordKindOf(static_cast<Opcode>(op));
    if (operand >= static_cast<uint32_t>(out_.num_keywords_) ||
        out_.keyword(static_cast<int>(operand)).kind != wanted) {
      return Fail(wanted == KeywordKind::kConnectorState ? "keyword names no state variable"
                                                         : "keyword names no sensor",
                  at_);
    }
    facts_[index].keywords |= uint64_t{1} << operand;
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
                          first == ValueType::kConnector ||
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
  const FunctionInfo info = out_.function(function);
  for (int i = info.num_arguments - 1; i >= 0; --i) {
    if (!PopType(info.local_types[i], state)) return false;
  }
  return true;
}

}  // namespace morphbus::vm
