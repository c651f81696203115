#pragma once
// The roles of a program, by name.

#include <string>
#include <vector>

#include "vm/image/program.h"

namespace morphbus::bridge {

/// The names of the roles that modules can play, which abstract ones are not, in the order of the
/// program: that in which RoleColors gives them colors.
[[nodiscard]] std::vector<std::string> PlayableRoles(const vm::VerifiedProgram& program);

}  // namespace morphbus::bridge
