#pragma once
// Worlds as the command line takes them.

#include <optional>
#include <string>
#include <vector>

#include "compiler/world/obstacle.h"

namespace morphbus::tools {

/// The obstacles of the SDFormat file of --world; nothing, after printing what is wrong with it, if
/// it cannot be used.
std::optional<std::vector<world::Obstacle>> LoadWorld(const std::string& path);

}  // namespace morphbus::tools
