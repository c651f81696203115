// Any datagrams through LCM's reassembly: never a crash, never more memory than it promises. The
// input is a sequence of datagrams, each after one byte for its sender and two for its size.

#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "bridge/bus/lcm_datagrams.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  morphbus::bridge::LcmDatagrams datagrams;
  volatile unsigned sum = 0;  // Every byte that is handed over is read.
  while (size >= 3) {
    const uint64_t sender = data[0];
    const size_t length = std::min<size_t>(size_t{data[1]} << 8 | data[2], size - 3);
    datagrams.Take(sender, data + 3, length,
                   [&](std::string_view channel, const uint8_t* bytes, size_t count) {
                     if (channel.empty() || channel.size() > 63) std::abort();
                     for (size_t i = 0; i < count; ++i) sum = sum + bytes[i];
                   });
    data += 3 + length;
    size -= 3 + length;
  }
  return 0;
}
