#pragma once
// Which names the code of a role uses and does not declare itself, before anything is known of what
// they mean.

#include <string>
#include <vector>

#include "compiler/dynarole/ast.h"

namespace morphbus::dynarole {

/// The names that stand alone in the expressions and assignments of the role's members, each once,
/// in the order of the text: variables and parameters of the member in which they stand are left
/// out, as is what is called.
std::vector<std::string> NamesUsedIn(const Role& role);

}  // namespace morphbus::dynarole
