#include "compiler/world/surface.h"

#include <fmt/format.h>

#include <algorithm>

namespace morphbus::world {

using Eigen::Vector3d;

Result<void> Check(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return Fail("has no triangle");
  // A file that shares no corners has three points for each triangle.
  if (mesh.triangles.size() > kMaxMeshTriangles || mesh.points.size() > 3 * kMaxMeshTriangles) {
    return Fail(
        fmt::format("has {} triangles, the most is {}", mesh.triangles.size(), kMaxMeshTriangles));
  }
  for (const Vector3d& p : mesh.points) {
    if (!p.allFinite()) return Fail("has a coordinate that is not finite");
  }
  // The indices come from a run's description as often as from a file, and nothing else looks at
  // them before they are used.
  for (const std::array<int, 3>& triangle : mesh.triangles) {
    for (const int corner : triangle) {
      if (corner < 0 || corner >= static_cast<int>(mesh.points.size())) {
        return Fail("has a triangle without a corner");
      }
    }
  }
  return {};
}

Result<void> Check(const Heights& heights) {
  // Pixels are corners of cells, so that one row or column makes no surface.
  if (std::min(heights.columns, heights.rows) < 2 ||
      std::max(heights.columns, heights.rows) > kMaxHeightSide) {
    return Fail(fmt::format("has {} x {} pixels; from 2 to {} a side are possible", heights.columns,
                            heights.rows, kMaxHeightSide));
  }
  const size_t pixels = static_cast<size_t>(heights.columns) * static_cast<size_t>(heights.rows);
  if (heights.samples.size() != pixels) return Fail("is cut");
  return {};
}

TriangleMesh Scaled(const TriangleMesh& mesh, const Vector3d& scale) {
  TriangleMesh scaled = mesh;
  for (Vector3d& p : scaled.points) p = p.cwiseProduct(scale);
  // An odd number of mirrored axes turns each triangle's corners clockwise; exchanging two of them
  // turns the outside out again.
  if (scale.prod() < 0.0) {
    for (std::array<int, 3>& triangle : scaled.triangles) std::swap(triangle[1], triangle[2]);
  }
  return scaled;
}

TriangleMesh MeshOf(const Heights& heights, const Vector3d& size, const Vector3d& pos) {
  TriangleMesh mesh;
  // A picture that is black all over is level.
  const double brightest = std::max<int>(1, *std::ranges::max_element(heights.samples));
  // Corners in fractions of the size: x and y from -1/2 to 1/2, the first row at the greatest y, z
  // from 0 to 1.
  for (int row = 0; row < heights.rows; ++row) {
    for (int column = 0; column < heights.columns; ++column) {
      const double x = static_cast<double>(column) / (heights.columns - 1) - 0.5;
      const double y = 0.5 - static_cast<double>(row) / (heights.rows - 1);
      const double z = heights.samples[row * heights.columns + column] / brightest;
      mesh.points.push_back(pos + Vector3d(x, y, z).cwiseProduct(size));
    }
  }
  // The four pixels of a cell, seen from above: a b over c d.
  for (int row = 0; row + 1 < heights.rows; ++row) {
    for (int column = 0; column + 1 < heights.columns; ++column) {
      const int a = row * heights.columns + column;
      const int c = a + heights.columns;
      // Both go counter-clockwise, so that the outside is above; b and c share the diagonal.
      mesh.triangles.push_back({a, c, a + 1});
      mesh.triangles.push_back({a + 1, c, c + 1});
    }
  }
  return mesh;
}

}  // namespace morphbus::world
