#include "tools/base/world_file.h"

#include "compiler/world/sdf_world.h"
#include "tools/base/messages.h"

namespace morphbus::tools {

std::optional<std::vector<world::Obstacle>> LoadWorld(const std::string& path) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const Result<int> file = sources.AddFile(path);
  if (!file) return Refuse("--world: " + file.error().message);
  std::optional<std::vector<world::Obstacle>> obstacles =
      world::ReadSdfWorld(sources, *file, nullptr, &diagnostics);
  PrintDiagnostics(diagnostics, sources);
  return obstacles;
}

}  // namespace morphbus::tools
