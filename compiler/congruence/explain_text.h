#pragma once
// Words for what the reasons speak of. Internal to compiler/congruence.

#include <cstddef>
#include <numbers>
#include <string>

#include "compiler/congruence/screw_graph.h"

namespace morphbus::congruence {

/// Degrees in a radian.
inline constexpr double kDegrees = 180.0 / std::numbers::pi;

/// A number with its noun: "no joints", "1 joint", "2 joints".
std::string CountedOrNo(size_t count, const std::string& one, const std::string& many = {});

/// The number to print for `v`: 0 for what is only rounding, and for -0.
double Plain(double v);

/// A vector with six digits: "(1, 0, 0.5)".
std::string Text(const Eigen::Vector3d& v);

/// A value (rad or m) of a joint with its unit: "90 degrees", "0.1 m".
std::string ValueText(const ScrewJoint& j, double value);

/// What a joint does: "turns from -90 to 90 degrees"; "turns without limits, with both ends in one
/// body".
std::string RangeText(const ScrewJoint& j);

}  // namespace morphbus::congruence
