#include "vm/image/code_state.h"

#include "vm/image/verify_error.h"

namespace morphbus::vm {

CodeState CodeState::AtBegin(int num_arguments) {
  CodeState state;
  state.set_locals = static_cast<uint16_t>((1u << num_arguments) - 1);
  return state;
}

// Both ends of the stack are watched here, so that the interpreter need not.
const char* CodeState::PopAny(ValueType* type) {
  if (depth == 0) return Reason("stack underflow");
  *type = types[--depth];
  return nullptr;
}

const char* CodeState::Pop(ValueType type) {
  ValueType found{};
  if (const char* problem = PopAny(&found)) return problem;
  return found == type ? nullptr : Reason("operand of the wrong type");
}

const char* CodeState::Push(ValueType type) {
  if (depth >= kStackCells) return Reason("stack overflow");
  types[depth++] = type;
  return nullptr;
}

}  // namespace morphbus::vm
