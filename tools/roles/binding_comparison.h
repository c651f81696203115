#pragma once
// Does a program bind the same on two congruent robots? Asked before any of them moves.

#include <cstddef>
#include <string>
#include <vector>

#include "compiler/congruence/congruence.h"
#include "compiler/model/robot_model.h"
#include "tools/roles/static_roles.h"

namespace morphbus::tools {

/// What a program binds on two congruent robots, under the mapping of them under which least
/// differs, of those that keep the robot frame if any does.
struct BindingComparison {
  /// That mapping, by index into Congruence::mappings; the first of several.
  size_t mapping = 0;
  /// One sentence each: first, in order of robot a's modules, another role, or a label that stands
  /// for another joint or link; then joints that turn the other way. Empty: bound alike.
  std::vector<std::string> differences;
};

/// Compares what the modules of two robots settled on. Bound alike are two robots if under one
/// mapping each module has its counterpart's role, each label of a joint or link stands for the
/// counterpart's, and values under setJointAxis turn joint and counterpart the same way: then the
/// program moves both alike.
/// @param answer  of `a` and `b`: congruent, with at least one mapping.
/// @param roles_a, roles_b  what SettleRoles says of the same program on each.
BindingComparison CompareBindings(const model::Model& model, const model::Robot& a,
                                  const StaticRoles& roles_a, const model::Robot& b,
                                  const StaticRoles& roles_b, const congruence::Congruence& answer);

}  // namespace morphbus::tools
