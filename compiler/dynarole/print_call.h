#pragma once
// The text of print, which checker and code generator must see alike.

#include <string>

#include "compiler/dynarole/ast.h"

namespace morphbus::dynarole {

/// The text of a call of print as the image holds it: its parts with spaces between them, and
/// places for the values (vm/image/print_text.h). The types of the values must be known.
std::string PrintTextOf(const Expr& call);

}  // namespace morphbus::dynarole
