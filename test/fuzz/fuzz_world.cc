// Any bytes as an SDFormat world: read or refused, never a crash; what is read is finite.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "compiler/world/sdf_world.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  // What the corpus names is there.
  morphbus::world::Surfaces surfaces;
  surfaces.meshes["terrain/ridges.stl"] = {
      {Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY()}, {{0, 1, 2}}};
  surfaces.heights["file://terrain/bumps.png"] = {2, 2, {0, 1, 2, 65535}};
  const auto read = morphbus::world::ReadSdfText(
      std::string(reinterpret_cast<const char*>(data), size), surfaces);
  if (!read) return 0;
  for (const morphbus::world::Obstacle& obstacle : *read) {
    if (!obstacle.X_WO.matrix().allFinite() || !obstacle.size.allFinite()) std::abort();
    for (const auto& p : morphbus::world::CornersOf(obstacle)) {
      if (!p.allFinite()) std::abort();
    }
  }
  return 0;
}
