#include "compiler/world/obstacle.h"

#include <cmath>
#include <numbers>

namespace morphbus::world {
namespace {

using Eigen::Vector3d;

// Sides of a cylinder in pictures, and of a sphere's circles; steps of 15 degrees.
constexpr int kSides = 24;

/// Corners of a ring of radius `r` at height `z`.
void AddRing(double r, double z, std::vector<Vector3d>* corners) {
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kSides;
    corners->emplace_back(r * std::cos(angle), r * std::sin(angle), z);
  }
}

}  // namespace

std::vector<Vector3d> CornersOf(const Obstacle& obstacle) {
  std::vector<Vector3d> corners;
  const Vector3d& size = obstacle.size;
  switch (obstacle.shape) {
    case Shape::kBox:
    case Shape::kPlane:
      // A plane is a box without height; corners that fall together do no harm.
      // Each of a corner's three bits says on which side of the middle it lies along one axis.
      for (int i = 0; i < 8; ++i) {
        const Vector3d side((i & 1) != 0 ? .5 : -.5, (i & 2) != 0 ? .5 : -.5,
                            (i & 4) != 0 ? .5 : -.5);
        corners.emplace_back(side.cwiseProduct(size));
      }
      break;
    case Shape::kCylinder:
      // Size is radius and length here; the cylinder's axis is z of O, and its middle the origin.
      AddRing(size.x(), -0.5 * size.y(), &corners);
      AddRing(size.x(), 0.5 * size.y(), &corners);
      break;
    case Shape::kSphere:
      // A ring for each circle of latitude, from pole to pole; the poles are single corners.
      for (int i = 1; i < kSides / 2; ++i) {
        const double angle = 2.0 * std::numbers::pi * i / kSides;
        AddRing(size.x() * std::sin(angle), size.x() * std::cos(angle), &corners);
      }
      corners.emplace_back(0, 0, size.x());
      corners.emplace_back(0, 0, -size.x());
      break;
    case Shape::kMesh:
      // Pictures draw a mesh by its triangles, whose indices are those of these corners.
      corners = obstacle.mesh->points;
      break;
  }
  return corners;
}

}  // namespace morphbus::world
