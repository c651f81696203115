#include "compiler/emit/triangle_plates.h"

#include <Eigen/Geometry>

namespace morphbus::emit {

std::vector<Plate> PlatesOf(const world::TriangleMesh& mesh) {
  // With less than this (m²) a plate's volume is too small for MuJoCo, and nothing can touch it.
  constexpr double kLeastArea = 1e-10;
  std::vector<Plate> plates;
  for (const std::array<int, 3>& triangle : mesh.triangles) {
    const Eigen::Vector3d &a = mesh.points[triangle[0]], &b = mesh.points[triangle[1]],
                          &c = mesh.points[triangle[2]];
    // Counter-clockwise as seen from outside, so that the normal points outwards.
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    if (0.5 * normal.norm() < kLeastArea) continue;
    const Eigen::Vector3d inwards = -kPlateThickness * normal.normalized();
    plates.push_back({a, b, c, a + inwards, b + inwards, c + inwards});
  }
  return plates;
}

}  // namespace morphbus::emit
