#include "compiler/emit/triangle_plates.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

namespace morphbus::emit {

std::vector<Plate> PlatesOf(const world::TriangleMesh& mesh) {
  // The least height of a triangle: this (m), and so many steps of its largest coordinate as a
  // float. A flatter one could become a line when it is read.
  constexpr double kLeastHeight = 1e-6;
  constexpr double kLeastSteps = 32.0;
  const auto largest = [](const Eigen::Vector3d& p) { return p.cwiseAbs().maxCoeff(); };
  std::vector<Plate> plates;
  for (const std::array<int, 3>& triangle : mesh.triangles) {
    const Eigen::Vector3d &a = mesh.points[triangle[0]], &b = mesh.points[triangle[1]],
                          &c = mesh.points[triangle[2]];
    // Counter-clockwise as seen from outside, so that the normal points outwards.
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    const double step =
        std::numeric_limits<float>::epsilon() * std::max({largest(a), largest(b), largest(c)});
    if (normal.norm() <= longest * std::max(kLeastHeight, kLeastSteps * step)) continue;
    const Eigen::Vector3d inwards = -kPlateThickness * normal.normalized();
    plates.push_back({a, b, c, a + inwards, b + inwards, c + inwards});
  }
  return plates;
}

}  // namespace morphbus::emit
