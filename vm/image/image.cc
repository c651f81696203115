#include "vm/image/image.h"

namespace morphbus::vm::image {

// FNV-1a (http://www.isthe.com/chongo/tech/comp/fnv/), whose own bytes are left out.
uint64_t HashOf(const uint8_t* bytes, uint32_t size) {
  uint64_t hash = 0xcbf29ce484222325u;
  for (uint32_t i = 0; i < size; ++i) {
    if (i >= kHashAt && i < kHashAt + 8) continue;
    hash = (hash ^ bytes[i]) * 0x100000001b3u;
  }
  return hash;
}

}  // namespace morphbus::vm::image
