#include "compiler/dynarole/print_call.h"

#include "compiler/dynarole/constants.h"

namespace morphbus::dynarole {

std::string PrintTextOf(const Expr& call) {
  std::string text;
  for (size_t i = 1; i < call.operands.size(); ++i) {
    const Expr& part = *call.operands[i];
    if (i > 1) text += ' ';
    if (part.kind != ExprKind::kText) {
      // What the value is converted to is what will lie on the stack.
      const Type type = part.wanted == Type::kUnknown ? part.type : part.wanted;
      text += std::string("{") + vm::InfoOf(ValueTypeOf(type)).letter + "}";
      continue;
    }
    for (const char c : part.name) text += c == '{' ? "{{" : std::string(1, c);
  }
  return text;
}

}  // namespace morphbus::dynarole
