#pragma once
// Words for what the reasons speak of. Internal to compiler/congruence.

#include <cstddef>
#include <numbers>
#include <string>

#include "compiler/congruence/assembly.h"

namespace morphbus::congruence {

inline constexpr double kDegrees = 180.0 / std::numbers::pi;

/// "no joints", "1 joint", "2 joints"
std::string Counted(size_t count, const std::string& one, const std::string& many);

/// -0 as 0, no tails of rounding.
double Plain(double v);

/// "(1, 0, 0.5)"
std::string Text(const Eigen::Vector3d& v);

/// A value of the joint: "90 degrees", "0.1 m"
std::string ValueText(const AssemblyJoint& j, double value);

/// "turns from -90 to 90 degrees"; "turns without limits, with both ends in one body"
std::string RangeText(const AssemblyJoint& j);

}  // namespace morphbus::congruence
