#include "vm/image/operand_checker.h"

#include "vm/image/verify_error.h"

namespace morphbus::vm {

namespace {

/// The text, unless what an operand names is there.
const char* Unless(bool exists, const char* text) { return exists ? nullptr : text; }

}  // namespace

const char* OperandChecker::Check(OperandKind kind, const uint8_t* at, CodeState* state,
                                  NamedOperand* named) {
  // The parts lie one behind the other. Each must name something that exists before its type can be
  // asked for.
  const OperandInfo& info = InfoOf(kind);
  for (int i = 0; i < kMostParts && info.parts[i] != OperandPart::kNone; ++i) {
    const OperandPart part = info.parts[i];
    if (const char* problem = CheckPart(part, at, state, named)) return problem;
    named->types[i] = TypeNamedBy(part, program_, function_, at);
    if (const char* problem = CheckType(part, named->types[i])) return problem;
    at += BytesOf(part);
  }
  return nullptr;
}

// Fields, labels and functions by the slots of the function's role, all else by numbers of the
// program. What calls and keywords need is noted on the way.
const char* OperandChecker::CheckPart(OperandPart part, const uint8_t* at, CodeState* state,
                                      NamedOperand* named) {
  const uint32_t number = NumberIn(part, at);
  const auto index = static_cast<int>(number);
  switch (part) {
    case OperandPart::kNone:
    case OperandPart::kSignedByte:
      return nullptr;
    case OperandPart::kConstant:
    case OperandPart::kIntConstant:
      return Unless(index < program_.num_constants(), Reason("no such constant"));
    case OperandPart::kText:
      named->number = number;
      return Unless(index < program_.num_constants(), Reason("no such text"));
    // Locals are set before they are read, on every way.
    case OperandPart::kLocal:
    case OperandPart::kIntLocal:
      if (number >= function_.num_locals) return Reason("no such local");
      return Unless((state->set_locals >> number & 1) != 0,
                    Reason("local is read before it is set"));
    case OperandPart::kStoredLocal:
      if (number >= function_.num_locals) return Reason("no such local");
      state->set_locals = static_cast<uint16_t>(state->set_locals | 1u << number);
      return nullptr;
    case OperandPart::kField:
      return Unless(number < program_.role(function_.role).num_fields, Reason("no such field"));
    case OperandPart::kLocalArray:
    case OperandPart::kFieldArray:
      return CheckArray(part, number, *state);
    case OperandPart::kLabel:
      return Unless(number < program_.role(function_.role).num_labels, Reason("no such label"));
    // A call names a slot, which each subrole fills in its way.
    case OperandPart::kMethod: {
      const RoleInfo role = program_.role(function_.role);
      if (number >= role.num_methods) return Reason("no such function");
      facts_.methods_called |= static_cast<uint16_t>(1u << number);
      // The signature of the own role's function serves for all: those that replace it have the
      // same.
      named->number = role.methods[index];
      return nullptr;
    }
    case OperandPart::kRole:
      return Unless(index < program_.num_roles(), Reason("no such role"));
    // An invocation goes to other modules, whose role stands before it.
    case OperandPart::kCommand: {
      const RoleInfo role = program_.role(at[-1]);
      if (number >= role.num_commands) return Reason("no such command");
      named->number = role.commands[index];
      return nullptr;
    }
    // The role of the neighbours stands before the field, too, and only shared fields are told.
    case OperandPart::kSharedField: {
      const RoleInfo role = program_.role(at[-1]);
      return Unless(number < role.num_fields && role.fields.shared(index),
                    Reason("no such shared field"));
    }
    case OperandPart::kSuperFunction:
      named->number = number;
      return CheckSuper(number);
    case OperandPart::kTarget:
      return CheckTarget(number, named);
    case OperandPart::kPartKeyword:
    case OperandPart::kStateKeyword:
    case OperandPart::kSensorKeyword:
    case OperandPart::kSensorKindKeyword:
      return CheckKeyword(part, number);
  }
  return nullptr;
}

// Which element is meant only the run shows, so that all of them must be what one has to be.
const char* OperandChecker::CheckArray(OperandPart part, uint32_t number,
                                       const CodeState& state) const {
  const uint32_t first = number & 255, count = number >> 8;
  const RoleInfo role = program_.role(function_.role);
  const bool local = part == OperandPart::kLocalArray;
  const uint32_t all = local ? function_.num_locals : role.num_fields;
  if (count == 0 || first + count > all) return Reason("no such array");
  const auto type = [&](uint32_t i) {
    const auto slot = static_cast<int>(i);
    return local ? function_.local_types[slot] : role.fields.type(slot);
  };
  for (uint32_t i = first; i < first + count; ++i) {
    if (type(i) != type(first)) return Reason("elements of an array differ in type");
    if (local && (state.set_locals >> i & 1) == 0) return Reason("local is read before it is set");
  }
  return nullptr;
}

// Which keywords a function needs decides which module types can take its roles.
const char* OperandChecker::CheckKeyword(OperandPart part, uint32_t number) {
  const bool exists = number < static_cast<uint32_t>(program_.num_keywords());
  if (part == OperandPart::kPartKeyword) {
    // Which kinds name a part is a question of their types.
    if (!exists) return Reason("no such keyword");
  } else {
    const KeywordKind wanted = part == OperandPart::kStateKeyword    ? KeywordKind::kConnectorState
                               : part == OperandPart::kSensorKeyword ? KeywordKind::kSensor
                                                                     : KeywordKind::kSensorKind;
    if (!exists || program_.keyword(static_cast<int>(number)).kind != wanted) {
      return wanted == KeywordKind::kConnectorState ? Reason("keyword names no state variable")
                                                    : Reason("keyword names no sensor");
    }
  }
  facts_.keywords |= uint64_t{1} << number;
  return nullptr;
}

// A member that replaces an inherited one may call it. Its slots are those of a role that the own
// one extends; so a role that uses the caller has them, too.
const char* OperandChecker::CheckSuper(uint32_t callee) {
  if (callee >= static_cast<uint32_t>(program_.num_functions())) return Reason("no such function");
  const int owner = function_.role;
  const int above = program_.function(static_cast<int>(callee)).role;
  // A function of the own role would run in a circle, one of any other has slots of its own.
  if (owner == above || !tree_.IsA(owner, above)) {
    return Reason("function of a role that the own one does not extend");
  }
  // A member replaces one other; so the calls of a function are found in one step.
  if (facts_.super_called != 0 && facts_.super_called != callee + 1) {
    return Reason("function calls two that it replaces");
  }
  facts_.super_called = static_cast<uint16_t>(callee + 1);
  return nullptr;
}

const char* OperandChecker::CheckTarget(uint32_t target, NamedOperand* named) const {
  const uint32_t byte = function_.code_begin + target;
  // Whoever jumps needs the state that the image states there; so a target is one of the joins.
  named->number = joins_.FirstFrom(byte);
  return Unless(target < function_.code_size && named->number != joins_.count() &&
                    joins_.target(named->number) == byte,
                Reason("target of a jump is not among the joins"));
}

// What is named exists by now; whether it will do depends on its type.
const char* OperandChecker::CheckType(OperandPart part, ValueType type) {
  switch (part) {
    case OperandPart::kConstant:
      return Unless(type != ValueType::kText, Reason("a text is no value"));
    case OperandPart::kIntConstant:
      return Unless(type == ValueType::kInt, Reason("no such constant"));
    case OperandPart::kText:
      return Unless(type == ValueType::kText, Reason("no such text"));
    case OperandPart::kIntLocal:
      return Unless(type == ValueType::kInt, Reason("operand of the wrong type"));
    case OperandPart::kPartKeyword:
      return Unless(type != ValueType::kVoid, Reason("keyword names no part"));
    default:
      return nullptr;
  }
}

}  // namespace morphbus::vm
