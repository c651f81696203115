#include "compiler/world/surface_files.h"

#include <filesystem>

#include "compiler/m3l/read_mesh.h"
#include "compiler/source/source_text.h"

namespace morphbus::world {

std::string FileOfUri(const std::string& world_file, const std::string& uri) {
  // The scheme is only dropped: what follows it may be relative as well, though a uri by RFC 8089
  // could not be.
  constexpr std::string_view kFile = "file://";
  // An absolute path stands for itself, since operator/ below lets it replace the folder.
  const std::string name = uri.starts_with(kFile) ? uri.substr(kFile.size()) : uri;
  return (std::filesystem::path(world_file).parent_path() / name).string();
}

SurfaceLoader FilesBeside(const std::string& world_file) {
  return
      [world_file](SurfaceKind kind, const std::string& uri, Surfaces* surfaces) -> Result<void> {
        // The system's calls would take the text before the zero byte for the whole name.
        if (uri.find('\0') != std::string::npos) return Fail("this is no file name");
        const std::string path = FileOfUri(world_file, uri);
        const Result<std::string> bytes = source::ReadSourceFile(path);
        if (!bytes) return Fail(bytes.error().message);
        // What was read is kept under the uri and not under the path: a run's description has no
        // files, and finds it again by what stands in the world's text.
        if (kind == SurfaceKind::kHeights) {
          Result<Heights> heights = ParseHeights(*bytes);
          if (!heights) return Fail("height map '" + path + "' " + heights.error().message);
          surfaces->heights[uri] = *std::move(heights);
          return {};
        }
        // M3L's reader of STL joins corners that coincide, and its errors name the file themselves;
        // the limits of a world's mesh are those of Check.
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
