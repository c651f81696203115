#pragma once
// Meshes in files, for hulls: STL, text or binary.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "compiler/base/result.h"

namespace morphbus::m3l {

/// Most triangles that a mesh may have: far more than a hull can show.
constexpr size_t kMaxTriangles = 50'000;

/// The corners of the convex hull of the STL file at `path`, in the file's own units. Errors: the
/// file cannot be read, is no sound STL, has no triangle or more than kMaxTriangles, or a
/// coordinate that is not finite; they name the path.
Result<std::vector<Eigen::Vector3d>> ReadMeshHull(const std::string& path);

/// The same for the bytes of a file, which `name` stands for in errors.
Result<std::vector<Eigen::Vector3d>> MeshHull(const std::string& name, const std::string& bytes);

}  // namespace morphbus::m3l
