#include "compiler/emit/webots_view.h"

#include <algorithm>
#include <cmath>

namespace morphbus::emit {

using Eigen::Vector3d;

model::Pose ViewOf(const std::vector<Vector3d>& points) {
  constexpr double kLeastRadius = 0.05;  // m, so that a single small module does not fill the view.
  constexpr double kMargin = 1.2;
  // The ball around all points, from the middle of their box, must fit the view.
  Eigen::AlignedBox3d box;
  for (const Vector3d& p : points) box.extend(p);
  if (box.isEmpty()) box.extend(Vector3d::Zero());
  const Vector3d middle = box.center();
  double radius = kLeastRadius;
  for (const Vector3d& p : points) radius = std::max(radius, (p - middle).norm());
  // Across the narrower side the view is narrower, and a ball's outline is seen before its middle.
  const double half_angle = std::atan(std::tan(0.5 * kFieldOfView) * 9.0 / 16.0);
  const double distance = kMargin * radius / std::sin(half_angle);
  // From the north-east and above, with the horizon level.
  const Vector3d forward = -Vector3d(0.8, 0.6, 0.7).normalized();
  const Vector3d left = Vector3d::UnitY().cross(forward).normalized();
  model::Pose X = model::Pose::Identity();
  X.linear() << forward, left, forward.cross(left);
  X.translation() = middle - distance * forward;
  return X;
}

}  // namespace morphbus::emit
