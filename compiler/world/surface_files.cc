#include "compiler/world/surface_files.h"

#include <filesystem>

#include "compiler/m3l/read_mesh.h"
#include "compiler/source/source_text.h"

namespace morphbus::world {

std::string FileOfUri(const std::string& world_file, const std::string& uri) {
  constexpr std::string_view kFile = "file://";
  const std::string name = uri.starts_with(kFile) ? uri.substr(kFile.size()) : uri;
  return (std::filesystem::path(world_file).parent_path() / name).string();
}

SurfaceLoader FilesBeside(const std::string& world_file) {
  return
      [world_file](SurfaceKind kind, const std::string& uri, Surfaces* surfaces) -> Result<void> {
        if (uri.find('\0') != std::string::npos) return Fail("this is no file name");
        const std::string path = FileOfUri(world_file, uri);
        const Result<std::string> bytes = source::ReadSourceFile(path);
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
