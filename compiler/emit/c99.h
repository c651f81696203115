#pragma once
// Forward kinematics of a robot or module as plain C99, for microcontrollers; of a module also the
// tables that the virtual machine needs.

#include <cstdint>
#include <string>

#include "compiler/emit/exported.h"
#include "compiler/emit/robot_tree.h"

namespace morphbus::emit {

/// `stem`.c and, as companion, `stem`.h: enumerators of links and joints, and one function that
/// computes the poses of all links. Single precision; no memory but its arguments, no loops, no
/// library but sinf and cosf. Constants are folded: a quarter turn costs no multiplication.
Exported ToC(const RobotTree& tree, const std::string& stem);

/// The same of module type `type` (an index) alone, and with it the tables of c_tables.h. Where the
/// module exceeds what the virtual machine holds there are no tables, and a warning says why.
Exported ModuleToC(const model::Model& model, int type, uint64_t model_hash,
                   const std::string& stem);

}  // namespace morphbus::emit
