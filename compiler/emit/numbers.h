#pragma once
// Numbers as texts of other programs want them: shortest form that reads back the same double,
// without negative zeros, and with rounding noise below 1e-15 shown as 0.

#include <Eigen/Geometry>
#include <array>
#include <string>
#include <utility>

#include "compiler/base/role_colors.h"

namespace morphbus::emit {

std::string Number(double value);
/// "x y z"
std::string Triple(const Eigen::Vector3d& v);

/// "r g b 1": a colour that nothing shines through, each part from 0 to 1 in three digits.
std::string Rgba(const Color& color);

/// Roll, pitch, yaw (rad) about fixed axes: R = Rz(yaw) * Ry(pitch) * Rx(roll). Exact to rounding
/// also where pitch is 90 degrees and roll and yaw are not determined one by one.
Eigen::Vector3d RollPitchYaw(const Eigen::Matrix3d& R);

/// Unit, with w >= 0.
Eigen::Quaterniond Canonical(const Eigen::Matrix3d& R);
/// "w x y z"
std::string QuaternionWxyz(const Eigen::Matrix3d& R);
/// "x y z w"
std::string QuaternionXyzw(const Eigen::Matrix3d& R);

/// The six entries of a symmetric inertia matrix (kg m^2) as URDF and SDF name and order them:
/// "ixx", "ixy", "ixz", "iyy", "iyz", "izz", each with its number.
std::array<std::pair<const char*, std::string>, 6> InertiaEntries(const Eigen::Matrix3d& I);

}  // namespace morphbus::emit
