#pragma once
// Robots as M3L texts, for what modules of models/ do not show.

#include <string>

#include "compiler/model/robot_model.h"

namespace morphbus::test {

/// A compiled text; must be without errors.
model::Model Compiled(const std::string& text);

/// "point NAME: ..., connector" at `p` (units), two of which are joined with their frames alike.
std::string Socket(const std::string& name, const Eigen::Vector3d& p);

/// "connection ...": point p of the one module's connector on q of the other's, oriented alike.
std::string Joining(const std::string& module_a, const std::string& module_b);

/// The robot of `model` with this name.
const model::Robot& Named(const model::Model& model, const std::string& name);

}  // namespace morphbus::test
