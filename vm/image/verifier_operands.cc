// Operands of instructions by their parts (vm/image/operands.def), and the stack by the letters of
// vm/image/opcodes.def. No instruction is known by name here.
#include "vm/image/opcodes.h"
#include "vm/image/print_text.h"
#include "vm/image/verifier.h"

namespace morphbus::vm {

// What a part names must exist; then its type is known, and must be one that the part allows.
bool Verifier::CheckOperand(int index, const FunctionInfo& function, OperandKind kind,
                            const uint8_t* at, StackState* state, Named* named) {
  const OperandInfo& info = InfoOf(kind);
  for (int i = 0; i < kMostParts && info.parts[i] != OperandPart::kNone; ++i) {
    const OperandPart part = info.parts[i];
    if (!CheckPart(index, function, part, at, state, named)) return false;
    named->types[i] = TypeNamedBy(part, out_, function, at);
    if (!CheckTypeOfPart(part, named->types[i])) return false;
    at += BytesOf(part);
  }
  return true;
}

// Fields, labels and functions by the slots of the function's role, all else by numbers of the
// program. What calls and keywords need is noted on the way.
bool Verifier::CheckPart(int index, const FunctionInfo& function, OperandPart part,
                         const uint8_t* at, StackState* state, Named* named) {
  const uint32_t number = NumberIn(part, at);
  switch (part) {
    case OperandPart::kNone:
    case OperandPart::kSignedByte:
      return true;
    case OperandPart::kConstant:
    case OperandPart::kIntConstant:
      return number < out_.num_constants_ || Fail("no such constant", at_);
    case OperandPart::kText:
      named->number = number;
      return number < out_.num_constants_ || Fail("no such text", at_);
    // Locals are set before they are read, on every way.
    case OperandPart::kLocal:
    case OperandPart::kIntLocal:
      if (number >= function.num_locals) return Fail("no such local", at_);
      return (state->set_locals >> number & 1) != 0 || Fail("local is read before it is set", at_);
    case OperandPart::kStoredLocal:
      if (number >= function.num_locals) return Fail("no such local", at_);
      state->set_locals = static_cast<uint16_t>(state->set_locals | 1u << number);
      return true;
    case OperandPart::kField:
      return number < out_.role(function.role).num_fields || Fail("no such field", at_);
    case OperandPart::kLabel:
      return number < out_.role(function.role).num_labels || Fail("no such label", at_);
    // A call names a slot, which each subrole fills in its way.
    case OperandPart::kMethod: {
      const RoleInfo role = out_.role(function.role);
      if (number >= role.num_methods) return Fail("no such function", at_);
      facts_[index].methods_called |= static_cast<uint16_t>(1u << number);
      named->number = role.methods[static_cast<int>(number)];
      return true;
    }
    case OperandPart::kRole:
      return number < static_cast<uint32_t>(out_.num_roles_) || Fail("no such role", at_);
    // An invocation goes to other modules, whose role stands before it.
    case OperandPart::kCommand: {
      const RoleInfo role = out_.role(at[-1]);
      if (number >= role.num_commands) return Fail("no such command", at_);
      named->number = role.commands[static_cast<int>(number)];
      return true;
    }
    case OperandPart::kSharedField: {
      const RoleInfo role = out_.role(at[-1]);
      return (number < role.num_fields && role.fields.shared(static_cast<int>(number))) ||
             Fail("no such shared field", at_);
    }
    case OperandPart::kSuperFunction:
      named->number = number;
      return CheckSuper(index, number);
    case OperandPart::kTarget:
      return FindJoin(function, number, &named->number);
    case OperandPart::kPartKeyword:
    case OperandPart::kStateKeyword:
    case OperandPart::kSensorKeyword:
    case OperandPart::kSensorKindKeyword:
      return CheckKeyword(index, part, number);
  }
  return true;
}

// Which keywords a function needs decides which module types can take its roles.
bool Verifier::CheckKeyword(int index, OperandPart part, uint32_t number) {
  const bool exists = number < static_cast<uint32_t>(out_.num_keywords_);
  if (part == OperandPart::kPartKeyword) {
    // Which kinds name a part is a question of their types.
    if (!exists) return Fail("no such keyword", at_);
  } else {
    const KeywordKind wanted = part == OperandPart::kStateKeyword    ? KeywordKind::kConnectorState
                               : part == OperandPart::kSensorKeyword ? KeywordKind::kSensor
                                                                     : KeywordKind::kSensorKind;
    if (!exists || out_.keyword(static_cast<int>(number)).kind != wanted) {
      return Fail(wanted == KeywordKind::kConnectorState ? "keyword names no state variable"
                                                         : "keyword names no sensor",
                  at_);
    }
  }
  facts_[index].keywords |= uint64_t{1} << number;
  return true;
}

// A member that replaces an inherited one may call it. Its slots are those of a role that the own
// one extends; so a role that uses the caller has them, too.
bool Verifier::CheckSuper(int index, uint32_t callee) {
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
  return true;
}

// What is named exists by now; whether it will do depends on its type.
bool Verifier::CheckTypeOfPart(OperandPart part, ValueType type) {
  switch (part) {
    case OperandPart::kConstant:
      return type != ValueType::kText || Fail("a text is no value", at_);
    case OperandPart::kIntConstant:
      return type == ValueType::kInt || Fail("no such constant", at_);
    case OperandPart::kText:
      return type == ValueType::kText || Fail("no such text", at_);
    case OperandPart::kIntLocal:
      return type == ValueType::kInt || Fail("operand of the wrong type", at_);
    case OperandPart::kPartKeyword:
      return type != ValueType::kVoid || Fail("keyword names no part", at_);
    default:
      return true;
  }
}

// What the instruction takes, from the top of the stack down, which is from the last letter.
bool Verifier::Take(const FunctionInfo& function, const OpcodeInfo& info, Named* named,
                    StackState* state) {
  for (int i = info.pops.size() - 1; i >= 0; --i) {
    if (!PopTerm(function, info.pops[i], named, state)) return false;
  }
  return true;
}

bool Verifier::PopTerm(const FunctionInfo& function, Term term, Named* named, StackState* state) {
  ValueType type = term.type();
  if (type != ValueType::kVoid) return PopType(type, state);
  switch (term.letter()) {
    case Letter::kFirstPart:
    case Letter::kSecondPart:
      return PopType(named->types[term.part()], state);
    case Letter::kAny:
      return PopAny(&type, state);
    case Letter::kComparable:
      if (!PopAny(&type, state)) return false;
      // The second value comes first, and waits for the one below it.
      if (named->compared == ValueType::kVoid) {
        named->compared = type;
        return true;
      }
      return (type == named->compared && IsComparable(type)) ||
             Fail("values cannot be compared", at_);
    case Letter::kArguments:
      return PopArguments(static_cast<int>(named->number), state);
    case Letter::kPlaces:
      return PopPlaces(static_cast<int>(named->number), state);
    case Letter::kOwnResult:
      return PopType(function.return_type, state);
    case Letter::kResult:
      break;  // It is pushed only.
  }
  return Fail("operand of the wrong type", at_);
}

bool Verifier::Leave(const OpcodeInfo& info, const Named& named, StackState* state) {
  // A type of its own, that of what a part names, or that of a result, of which there may be none.
  for (const Term term : info.pushes) {
    ValueType type = term.type();
    if (term.part() >= 0) {
      type = named.types[term.part()];
    } else if (term.letter() == Letter::kResult) {
      type = out_.function(static_cast<int>(named.number)).return_type;
      if (type == ValueType::kVoid) continue;
    }
    if (!PushType(type, state)) return false;
  }
  return true;
}

// Floats are compared by an instruction of their own, and sets not at all.
bool Verifier::IsComparable(ValueType type) {
  return type == ValueType::kBool || type == ValueType::kInt || type == ValueType::kConnector ||
         (type >= ValueType::kDirection && type <= ValueType::kLink);
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
  // The last argument is the top of the stack.
  const FunctionInfo info = out_.function(function);
  for (int i = info.num_arguments - 1; i >= 0; --i) {
    if (!PopType(info.local_types[i], state)) return false;
  }
  return true;
}

bool Verifier::PopPlaces(int text, StackState* state) {
  PrintPlaces places;
  FindPlaces(out_.text(text), &places);
  for (int i = places.count - 1; i >= 0; --i) {
    if (!PopType(places.types[i], state)) return false;
  }
  return true;
}

}  // namespace morphbus::vm
