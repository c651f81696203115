#pragma once
// What a verifier knows at an instruction: the types of the operands on the stack, and which locals
// have a value.

#include <cstdint>

#include "vm/image/values.h"
#include "vm/limits.h"

namespace morphbus::vm {

/// The state of a function at one of its instructions, without values. Its functions that return a
/// text say what is wrong, in a few words, and nullptr if nothing is.
struct CodeState {
  /// The types of the operands, the deepest first, of which `depth` are in use.
  ValueType types[kStackCells] = {};
  int depth = 0;
  /// A bit for each local that has been set.
  uint16_t set_locals = 0;

  /// Where a function begins: the stack is empty, and of the locals only the arguments are set.
  static CodeState AtBegin(int num_arguments);
  /// Takes the top of the stack, whatever its type, which goes to `type`; or one of this type.
  [[nodiscard]] const char* PopAny(ValueType* type);
  [[nodiscard]] const char* Pop(ValueType type);
  /// Puts an operand of this type on the stack.
  [[nodiscard]] const char* Push(ValueType type);
};

}  // namespace morphbus::vm
