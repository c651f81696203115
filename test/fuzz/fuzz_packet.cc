// A neighbour's packet from a serial line: any bytes are read or refused, and what was read is
// written again as the same bytes.

#include <cstdlib>
#include <cstring>
#include <memory>

#include "vm/spread/packet.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace morphbus::vm;
  if (size > kMaxPacketBytes) return 0;
  const auto message = std::make_unique<NeighbourMessage>();
  if (!ReadPacket(data, static_cast<int>(size), message.get())) return 0;
  uint8_t again[kMaxPacketBytes];
  const int written = WritePacket(*message, again);
  if (written != static_cast<int>(size) || std::memcmp(again, data, size) != 0) std::abort();
  return 0;
}
