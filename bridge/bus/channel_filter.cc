#include "bridge/bus/channel_filter.h"

#include <sys/socket.h>

#include <algorithm>
#include <cstdint>

namespace morphbus::bridge {
namespace {

constexpr uint32_t kMagicOffset = 8;        // After the UDP header.
constexpr uint32_t kChannelOffset = 16;     // After LCM's magic and sequence number.
constexpr uint32_t kShort = 0x4c433032;     // "LC02"
constexpr uint32_t kFragment = 0x4c433033;  // "LC03"

/// Instruction: load 1, 2 or 4 bytes at an offset from the UDP header, in network order.
sock_filter Load(uint16_t width, uint32_t offset) {
  return BPF_STMT(static_cast<uint16_t>(BPF_LD | width | BPF_ABS), offset);
}

/// Instruction: pass so many bytes of the packet; 0 drops it.
sock_filter Return(uint32_t bytes) { return BPF_STMT(BPF_RET | BPF_K, bytes); }

/// Instruction: skip so many instructions, depending on whether what was loaded is `value`.
sock_filter JumpIfEqual(uint32_t value, uint8_t if_equal, uint8_t if_not) {
  return BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, value, if_equal, if_not);
}

/// Appends: pass if the bytes at the channel's place are `channel` and a NUL, else fall through.
void AppendChannel(const std::string& channel, std::vector<sock_filter>* program) {
  // The bytes in chunks of 4, 2, 1; never beyond the NUL, since a load past the packet rejects it.
  struct Chunk {
    uint16_t width;
    uint32_t offset, value;
  };
  std::vector<Chunk> chunks;
  const size_t size = channel.size() + 1;
  for (size_t at = 0; at < size;) {
    const size_t bytes = size - at >= 4 ? 4 : (size - at >= 2 ? 2 : 1);
    uint32_t value = 0;
    for (size_t i = 0; i < bytes; ++i) {
      value = value << 8 | static_cast<uint8_t>(channel.c_str()[at + i]);
    }
    const uint16_t width = bytes == 4 ? BPF_W : (bytes == 2 ? BPF_H : BPF_B);
    chunks.push_back({width, kChannelOffset + static_cast<uint32_t>(at), value});
    at += bytes;
  }
  // At most 64 / 4 + 2 chunks of two instructions: the jumps fit into 8 bits.
  for (size_t i = 0; i < chunks.size(); ++i) {
    const size_t after = 2 * (chunks.size() - i - 1) + 1;  // To behind this channel's Return.
    program->push_back(Load(chunks[i].width, chunks[i].offset));
    program->push_back(JumpIfEqual(chunks[i].value, 0, static_cast<uint8_t>(after)));
  }
  program->push_back(Return(UINT32_MAX));
}

}  // namespace

std::vector<sock_filter> BuildChannelFilter(std::vector<std::string> channels) {
  // Short names first: comparing with a name never reads beyond packets of names at least as long,
  // so no packet is rejected for its size before its own name had its turn.
  std::sort(channels.begin(), channels.end(), [](const std::string& a, const std::string& b) {
    return a.size() != b.size() ? a.size() < b.size() : a < b;
  });
  std::vector<sock_filter> program = {Load(BPF_W, kMagicOffset), JumpIfEqual(kFragment, 0, 1),
                                      Return(UINT32_MAX), JumpIfEqual(kShort, 1, 0), Return(0)};
  for (const std::string& channel : channels) AppendChannel(channel, &program);
  program.push_back(Return(0));
  if (program.size() > BPF_MAXINSNS) program.clear();
  return program;
}

bool AttachFilter(int fd, const std::vector<sock_filter>& program) {
  if (program.empty()) {
    const int unused = 0;
    // Fails if there is none, which is what we want.
    setsockopt(fd, SOL_SOCKET, SO_DETACH_FILTER, &unused, sizeof unused);
    return true;
  }
  sock_fprog description = {};
  description.len = static_cast<uint16_t>(program.size());
  description.filter = const_cast<sock_filter*>(program.data());
  return setsockopt(fd, SOL_SOCKET, SO_ATTACH_FILTER, &description, sizeof description) == 0;
}

}  // namespace morphbus::bridge
