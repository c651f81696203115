#pragma once
// Surfaces that no formula describes: meshes and height maps, which worlds keep in files of their
// own.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "compiler/base/result.h"

namespace morphbus::world {

/// Triangles that stand for themselves: the surface is not closed by a hull.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> points;  ///< Corners; metres once they belong to an obstacle.
  /// Indices of corners, counter-clockwise as seen from outside.
  std::vector<std::array<int, 3>> triangles;
};

/// A grey picture of heights, row by row from the top; black, 0, is the lowest height.
struct Heights {
  int columns = 0;
  int rows = 0;
  std::vector<uint16_t> samples;  ///< rows x columns
};

/// Most pixels of a side of a height map; the fewest are 2.
constexpr int kMaxHeightSide = 257;
/// Most triangles of one mesh file.
constexpr size_t kMaxMeshTriangles = 50'000;

/// What the files hold that a world names, by their uri as it stands in the world. A run's
/// description carries it beside the world's text.
struct Surfaces {
  std::map<std::string, TriangleMesh> meshes;  ///< In the files' own units; floats.
  std::map<std::string, Heights> heights;
};

/// Which of the two a uri is to name.
enum class SurfaceKind { kMesh, kHeights };

/// Puts what the uri names into the surfaces; the error is a sentence without place.
using SurfaceLoader =
    std::function<Result<void>(SurfaceKind kind, const std::string& uri, Surfaces* surfaces)>;

/// Whether the surface can be used: counts within the limits, indices of corners that there are,
/// coordinates that are finite.
Result<void> Check(const TriangleMesh& mesh);
Result<void> Check(const Heights& heights);

/// The mesh stretched along its axes; a mirrored one keeps its outside. `scale`: unit of the mesh
/// to m.
TriangleMesh Scaled(const TriangleMesh& mesh, const Eigen::Vector3d& scale);

/// Heights as two triangles between each four pixels, z up: the corner pixels are at the corners of
/// a rectangle of size.x() by size.y() round the z axis, the first row at +y, the first column at
/// -x; black is at height 0, and the brightest pixel at size.z(), as in Gazebo. All is shifted by
/// `pos`. Metres.
TriangleMesh MeshOf(const Heights& heights, const Eigen::Vector3d& size,
                    const Eigen::Vector3d& pos);

}  // namespace morphbus::world
