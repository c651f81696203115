#include "tools/base/world_file.h"

#include "compiler/world/sdf_world.h"
#include "compiler/world/surface_files.h"
#include "tools/base/messages.h"

namespace morphbus::tools {

std::optional<LoadedWorld> LoadWorld(const std::string& path) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  // What is wrong with the world is told at its place in the file.
  const Result<int> file = sources.AddFile(path);
  if (!file) return Refuse("--world: " + file.error().message);
  std::optional<world::SdfWorld> world =
      world::ReadSdfWorld(sources, *file, world::FilesBeside(path), &diagnostics);
  PrintDiagnostics(diagnostics, sources);
  if (!world) return std::nullopt;
  // An export must overwrite none of the files that its world was read from.
  LoadedWorld loaded{std::move(world->obstacles), {path}};
  for (const auto& [uri, mesh] : world->surfaces.meshes) {
    loaded.files.push_back(world::FileOfUri(path, uri));
  }
  for (const auto& [uri, heights] : world->surfaces.heights) {
    loaded.files.push_back(world::FileOfUri(path, uri));
  }
  return loaded;
}

}  // namespace morphbus::tools
