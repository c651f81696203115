#include "compiler/emit/numbers.h"

#include <fmt/format.h>

#include <cmath>

namespace morphbus::emit {

std::string Number(double value) {
  // Rounding noise, and negative zeros, would make equal robots unequal files.
  if (std::abs(value) < 1e-15) return "0";
  return fmt::format("{}", value);
}

std::string Triple(const Eigen::Vector3d& v) {
  return Number(v.x()) + " " + Number(v.y()) + " " + Number(v.z());
}

std::string Rgba(const Color& color) {
  return fmt::format("{:.3g} {:.3g} {:.3g} 1", color[0], color[1], color[2]);
}

// Where x points along z, only roll and yaw together are determined, and yaw is 0.
Eigen::Vector3d RollPitchYaw(const Eigen::Matrix3d& R) {
  // Upright: x does not point along z, so that its direction in the plane tells the yaw.
  constexpr double kRounding = 1e-12;
  const bool upright = std::abs(R(0, 0)) > kRounding || std::abs(R(1, 0)) > kRounding;
  const double yaw = upright ? std::atan2(R(1, 0), R(0, 0)) : 0.0;
  const double s = std::sin(yaw);
  const double c = std::cos(yaw);
  // The others are those of Rz(-yaw) * R, which makes up for whatever yaw lacks.
  const double pitch = std::atan2(-R(2, 0), c * R(0, 0) + s * R(1, 0));
  const double roll = std::atan2(s * R(0, 2) - c * R(1, 2), c * R(1, 1) - s * R(0, 1));
  return {roll, pitch, yaw};
}

Eigen::Quaterniond Canonical(const Eigen::Matrix3d& R) {
  // A rotation has two quaternions; the one with w >= 0 is written.
  Eigen::Quaterniond q(R);
  q.normalize();
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  return q;
}

std::string QuaternionWxyz(const Eigen::Matrix3d& R) {
  const Eigen::Quaterniond q = Canonical(R);
  return Number(q.w()) + " " + Triple(q.vec());
}

std::string QuaternionXyzw(const Eigen::Matrix3d& R) {
  const Eigen::Quaterniond q = Canonical(R);
  return Triple(q.vec()) + " " + Number(q.w());
}

std::array<std::pair<const char*, std::string>, 6> InertiaEntries(const Eigen::Matrix3d& I) {
  return {{{"ixx", Number(I(0, 0))},
           {"ixy", Number(I(0, 1))},
           {"ixz", Number(I(0, 2))},
           {"iyy", Number(I(1, 1))},
           {"iyz", Number(I(1, 2))},
           {"izz", Number(I(2, 2))}}};
}

}  // namespace morphbus::emit
