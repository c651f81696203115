#pragma once
// Worlds as the command line takes them.

#include <optional>
#include <string>
#include <vector>

#include "compiler/world/obstacle.h"

namespace morphbus::tools {

/// A world, and the files that it was read from.
struct LoadedWorld {
  std::vector<world::Obstacle> obstacles;
  /// The world's own file and those of its meshes and height maps.
  std::vector<std::string> files;
};

/// The SDFormat file of --world; nothing, after printing what is wrong with it, if it cannot be
/// used.
std::optional<LoadedWorld> LoadWorld(const std::string& path);

}  // namespace morphbus::tools
