#pragma once
// Forward kinematics of a robot or module as plain C99, for microcontrollers.

#include <string>

#include "compiler/emit/exported.h"
#include "compiler/emit/robot_tree.h"

namespace morphbus::emit {

/// `stem`.c and, as companion, `stem`.h: enumerators of links and joints, and one function that
/// computes the poses of all links. Single precision; no memory but its arguments, no loops, no
/// library but sinf and cosf. Constants are folded: a quarter turn costs no multiplication.
Exported ToC(const RobotTree& tree, const std::string& stem);

}  // namespace morphbus::emit
