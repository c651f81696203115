#pragma once
// What programs print, as text: the one place where it is worded, for every tool. Host side only.

#include <string>

#include "vm/image/kinematics_image.h"
#include "vm/image/program.h"

namespace morphbus::vm {

/// A value as it would stand in a program. Joints, links and connectors have the names of the
/// module type, or their numbers where `kinematics` is null. Never fails.
std::string ValueText(const VerifiedProgram& program, const VerifiedKinematics* kinematics,
                      ValueType type, Cell value);

/// A text of print with its values in their places. Joints, links and connectors have the names of
/// the module type, or their numbers where `kinematics` is null. Never fails: where the program has
/// no such text, or the text other places, the numbers stand alone.
/// @param text    number of the text among the program's constants.
/// @param values  as many as `count`.
std::string PrintText(const VerifiedProgram& program, const VerifiedKinematics* kinematics,
                      int text, const Cell* values, int count);

}  // namespace morphbus::vm
