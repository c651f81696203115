#include "bridge/bus/lcm_datagrams.h"

#include <algorithm>
#include <cstring>

#include "bridge/bus/bus.h"
#include "compiler/base/big_endian.h"

namespace morphbus::bridge {
namespace {

constexpr size_t kShortHeader = 8;  // Magic, sequence number.

/// The NUL-terminated channel at the start of `data`; empty if there is none of a legal length.
std::string_view ChannelAt(const uint8_t* data, size_t size) {
  const void* end = std::memchr(data, 0, std::min(size, kMaxChannelName + 1));
  if (end == nullptr) return {};
  const auto length = static_cast<size_t>(static_cast<const uint8_t*>(end) - data);
  return {reinterpret_cast<const char*>(data), length};
}

}  // namespace

void LcmDatagrams::Take(const uint8_t* data, size_t size, const Sink& sink) {
  // The first four bytes tell short messages from fragments, and both from strangers.
  const uint32_t magic = size >= kShortHeader ? LoadBigEndian<uint32_t>(data) : 0;
  if (magic == kLcmFragmentMagic) {
    ++fragments_;
    return;
  }
  const std::string_view channel = magic == kLcmShortMagic
                                       ? ChannelAt(data + kShortHeader, size - kShortHeader)
                                       : std::string_view();
  if (channel.empty()) {
    ++bad_;
    return;
  }
  // What follows the channel's name is the message.
  const size_t header = kShortHeader + channel.size() + 1;
  sink(channel, data + header, size - header);
}

}  // namespace morphbus::bridge
