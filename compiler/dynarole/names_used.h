#pragma once
// Which names code uses, before anything is known of what they mean.

#include <string>
#include <vector>

#include "compiler/dynarole/ast.h"

namespace morphbus::dynarole {

/// The names that stand alone in the expressions and assignments of the role's members, each once,
/// in the order of the text: variables and parameters of the member in which they stand are left
/// out, as is what is called.
std::vector<std::string> NamesUsedIn(const Role& role);

/// Moves the functions of imported files (those of other numbers than 0) that no code names, but
/// perhaps other such functions, from the root's members to Program::left_out. The root goes, too,
/// if nothing of it is left.
void LeaveOutUnused(Program* program);

}  // namespace morphbus::dynarole
