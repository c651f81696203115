// Any bytes as a PNG of heights: read or refused, never a crash.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "compiler/world/surface_files.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  const auto heights = morphbus::world::ParseHeights(bytes);
  if (heights && !morphbus::world::Check(*heights)) std::abort();
  return 0;
}
