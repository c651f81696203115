#include "vm/image/stack_effect.h"

#include "vm/image/print_text.h"
#include "vm/image/verify_error.h"

namespace morphbus::vm {

namespace {

/// True for types whose values are the same if their bits are. Floats are compared by an
/// instruction of their own, and sets not at all.
bool IsComparable(ValueType type) {
  return type == ValueType::kBool || type == ValueType::kInt || type == ValueType::kConnector ||
         (type >= ValueType::kDirection && type <= ValueType::kLink);
}

}  // namespace

const char* StackEffect::Take(CodeState* state) {
  // What was pushed last is taken first.
  for (int i = info_.pops.size() - 1; i >= 0; --i) {
    if (const char* problem = Pop(info_.pops[i], state)) return problem;
  }
  return nullptr;
}

const char* StackEffect::Leave(CodeState* state) const {
  // A type of its own, that of what a part names, or that of a result, of which there may be none.
  for (const Term term : info_.pushes) {
    ValueType type = term.type();
    if (term.part() >= 0) {
      type = named_.types[term.part()];
    } else if (term.letter() == Letter::kResult) {
      type = program_.function(static_cast<int>(named_.number)).return_type;
      if (type == ValueType::kVoid) continue;
    }
    if (const char* problem = state->Push(type)) return problem;
  }
  return nullptr;
}

const char* StackEffect::Pop(Term term, CodeState* state) {
  // Most letters are types, which need no look at what the operand names.
  ValueType type = term.type();
  if (type != ValueType::kVoid) return state->Pop(type);
  switch (term.letter()) {
    case Letter::kFirstPart:
    case Letter::kSecondPart:
      return state->Pop(named_.types[term.part()]);
    // What the instruction drops may be anything.
    case Letter::kAny:
      return state->PopAny(&type);
    case Letter::kComparable:
      return PopCompared(state);
    case Letter::kArguments:
      return PopArguments(state);
    case Letter::kPlaces:
      return PopPlaces(state);
    // A return gives what the function's signature promises.
    case Letter::kOwnResult:
      return state->Pop(function_.return_type);
    case Letter::kResult:
      break;  // It is pushed only.
  }
  return Reason("operand of the wrong type");
}

const char* StackEffect::PopCompared(CodeState* state) {
  ValueType type{};
  if (const char* problem = state->PopAny(&type)) return problem;
  // The second value comes first, and waits for the one below it.
  if (compared_ == ValueType::kVoid) {
    compared_ = type;
    return nullptr;
  }
  return type == compared_ && IsComparable(type) ? nullptr : Reason("values cannot be compared");
}

const char* StackEffect::PopArguments(CodeState* state) const {
  // The last argument is the top of the stack.
  const FunctionInfo callee = program_.function(static_cast<int>(named_.number));
  for (int i = callee.num_arguments - 1; i >= 0; --i) {
    if (const char* problem = state->Pop(callee.local_types[i])) return problem;
  }
  return nullptr;
}

const char* StackEffect::PopPlaces(CodeState* state) const {
  // The text has been checked, so that its places are sound; the value of the last one lies on top.
  PrintPlaces places;
  FindPlaces(program_.text(static_cast<int>(named_.number)), &places);
  for (int i = places.count - 1; i >= 0; --i) {
    if (const char* problem = state->Pop(places.types[i])) return problem;
  }
  return nullptr;
}

}  // namespace morphbus::vm
