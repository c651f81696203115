#pragma once
// Surfaces made of triangles, for programs that take every mesh for its convex hull: a plate for
// each triangle, which is its own hull.

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "compiler/world/surface.h"

namespace morphbus::emit {

/// How thick a plate is (m). What moves by less in a step does not pass through it; with steps of 2
/// ms that is 2.5 m/s. Where two faces meet at less than a right angle, and where a body is thinner
/// than this, the backs of plates stand out of the faces on the other side, by this at most.
inline constexpr double kPlateThickness = 5e-3;

/// The most plates of a world. Each one is a body of its own to the other program's collisions.
inline constexpr size_t kMostPlates = 20'000;

/// A plate's corners (m): those of the triangle, and behind each, as seen from outside, another.
using Plate = std::array<Eigen::Vector3d, 6>;

/// The plates of a mesh, in its own frame and order. A triangle that is too thin for the single
/// precision in which MuJoCo keeps corners has none.
std::vector<Plate> PlatesOf(const world::TriangleMesh& mesh);

}  // namespace morphbus::emit
