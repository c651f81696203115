// Any bytes as an SDFormat world: read or refused, never a crash; what is read is finite.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "compiler/world/sdf_world.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const auto read =
      morphbus::world::ReadSdfText(std::string(reinterpret_cast<const char*>(data), size));
  if (!read) return 0;
  for (const morphbus::world::Obstacle& obstacle : *read) {
    if (!obstacle.X_WO.matrix().allFinite() || !obstacle.size.allFinite()) std::abort();
    for (const auto& p : morphbus::world::CornersOf(obstacle)) {
      if (!p.allFinite()) std::abort();
    }
  }
  return 0;
}
