#pragma once
// Meshes in files: STL, text or binary, and for what is only looked at OBJ and glTF.

#include <Eigen/Core>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/base/result.h"

namespace morphbus::m3l {

/// Most triangles that a mesh may have: far more than a hull can show.
constexpr size_t kMaxTriangles = 50'000;

/// The triangles of a mesh, in the file's own units.
struct MeshTriangles {
  std::vector<Eigen::Vector3d> points;  ///< Corners, each once; floats, as the file has them.
  std::vector<std::array<int, 3>> triangles;
};

/// The triangles of the bytes of an STL file, which `name` stands for in errors; those without an
/// area are left out. Errors as of ReadMeshHull.
Result<MeshTriangles> ParseMesh(const std::string& name, const std::string& bytes);

/// How the names of mesh files end: STL, which hulls have alone, then OBJ and glTF.
inline constexpr std::array<std::string_view, 4> kMeshEndings = {".stl", ".obj", ".gltf", ".glb"};

/// The triangles of the mesh file at `path`, by the end of its name (kMeshEndings); those of glTF
/// where its nodes stand. A file that needs another one is refused. Errors as of ReadMeshHull.
Result<MeshTriangles> ReadMesh(const std::string& path);

/// The same for the bytes of a file, which `name` stands for.
Result<MeshTriangles> ParseAnyMesh(const std::string& name, const std::string& bytes);

/// The corners of the convex hull of the STL file at `path`, in the file's own units. Errors: the
/// file cannot be read, is no sound STL, has no triangle or more than kMaxTriangles, or a
/// coordinate that is not finite; they name the path.
Result<std::vector<Eigen::Vector3d>> ReadMeshHull(const std::string& path);

/// The same for the bytes of a file, which `name` stands for in errors.
Result<std::vector<Eigen::Vector3d>> MeshHull(const std::string& name, const std::string& bytes);

}  // namespace morphbus::m3l
