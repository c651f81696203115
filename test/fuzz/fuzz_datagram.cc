// Any datagrams through the receiving side of LCM's protocol: never a crash, and no message but
// what stands in one datagram. The input is a sequence of datagrams, each after an unused byte and
// two for its size.

#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "bridge/bus/lcm_datagrams.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  morphbus::bridge::LcmDatagrams datagrams;
  volatile unsigned sum = 0;  // Every byte that is handed over is read.
  while (size >= 3) {
    const size_t length = std::min<size_t>(size_t{data[1]} << 8 | data[2], size - 3);
    datagrams.Take(data + 3, length,
                   [&](std::string_view channel, const uint8_t* bytes, size_t count) {
                     if (channel.empty() || channel.size() > 63 || count > length) std::abort();
                     for (size_t i = 0; i < count; ++i) sum = sum + bytes[i];
                   });
    data += 3 + length;
    size -= 3 + length;
  }
  return 0;
}
