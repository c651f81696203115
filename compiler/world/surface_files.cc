#include "compiler/world/surface_files.h"

#include <filesystem>

#include "compiler/m3l/read_mesh.h"
#include "compiler/source/source_text.h"

namespace morphbus::world {

SurfaceLoader FilesBeside(const std::string& world_file) {
  const std::filesystem::path folder = std::filesystem::path(world_file).parent_path();
  return [folder](SurfaceKind kind, const std::string& uri, Surfaces* surfaces) -> Result<void> {
    constexpr std::string_view kFile = "file://";
    const std::string name = uri.starts_with(kFile) ? uri.substr(kFile.size()) : uri;
    if (name.find('\0') != std::string::npos) return Fail("this is no file name");
    const std::string path = (folder / name).string();
    const Result<std::string> bytes = source::ReadRegularFile(path);
    if (!bytes) return Fail(bytes.error().message);
    if (kind == SurfaceKind::kHeights) {
      Result<Heights> heights = ParseHeights(*bytes);
      if (!heights) return Fail("height map '" + path + "' " + heights.error().message);
      surfaces->heights[uri] = *std::move(heights);
      return {};
    }
    Result<m3l::MeshTriangles> read = m3l::ParseMesh(path, *bytes);
    if (!read) return Fail(read.error().message);
    TriangleMesh mesh{std::move(read->points), std::move(read->triangles)};
    if (Result<void> good = Check(mesh); !good) {
      return Fail("mesh '" + path + "' " + good.error().message);
    }
    surfaces->meshes[uri] = std::move(mesh);
    return {};
  };
}

}  // namespace morphbus::world
