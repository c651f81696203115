#pragma once
// Texts of an image as strings, which end where they end and own their characters. Host side only.

#include <string>
#include <vector>

#include "vm/image/program.h"

namespace morphbus::vm {

/// A copy of a text, which need not outlive the image then.
inline std::string ToString(Text text) { return {text.data, text.size}; }

/// The names of the roles that modules can play, which abstract ones are not, in the order of the
/// program: that in which RoleColors gives them colors.
[[nodiscard]] std::vector<std::string> PlayableRoles(const VerifiedProgram& program);

}  // namespace morphbus::vm
