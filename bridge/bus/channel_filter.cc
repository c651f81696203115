#include "bridge/bus/channel_filter.h"

#include <sys/socket.h>

#include <algorithm>
#include <cstdint>

#include "bridge/bus/lcm_datagrams.h"

namespace morphbus::bridge {
namespace {

constexpr uint32_t kMagicOffset = 8;     // After the UDP header.
constexpr uint32_t kChannelOffset = 16;  // After LCM's magic and sequence number.

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

/// The text's bytes from `at`, as many as a load takes, as a number in network order.
uint32_t NumberAt(const char* text, size_t at, size_t bytes) {
  uint32_t value = 0;
  for (size_t i = 0; i < bytes; ++i) value = value << 8 | static_cast<uint8_t>(text[at + i]);
  return value;
}

/// Appends: if the channel begins with the prefix, and somewhere behind it the suffix begins, pass;
/// else drop.
void AppendPattern(const ChannelPattern& pattern, std::vector<sock_filter>* program) {
  const auto prefix = static_cast<uint32_t>(pattern.prefix.size());
  for (uint32_t at = 0; at < prefix; ++at) {
    program->push_back(Load(BPF_B, kChannelOffset + at));
    program->push_back(JumpIfEqual(NumberAt(pattern.prefix.c_str(), at, 1), 1, 0));
    program->push_back(Return(0));
  }
  // The name between them has a length from 1 on; a packet that ends before is dropped.
  const uint32_t suffix = NumberAt(pattern.suffix.c_str(), 0, 4);
  for (uint32_t name = 1; prefix + name + pattern.suffix.size() <= kMaxChannelName; ++name) {
    program->push_back(Load(BPF_W, kChannelOffset + prefix + name));
    program->push_back(JumpIfEqual(suffix, 0, 1));
    program->push_back(Return(UINT32_MAX));
  }
}

/// Appends: if the bytes at the channel's place are the channel and a NUL, pass what of it is of
/// interest and drop the rest; else fall through.
void AppendChannel(const ChannelInterest& wanted, std::vector<sock_filter>* program) {
  const std::string& channel = wanted.channel;
  const Interest& interest = wanted.interest;
  const bool conditional = interest.width == 1 || interest.width == 2;
  // The bytes in chunks of 4, 2, 1; never beyond the NUL, since a load past the packet rejects it.
  struct Chunk {
    uint16_t width;
    uint32_t offset, value;
  };
  std::vector<Chunk> chunks;
  const size_t size = channel.size() + 1;
  for (size_t at = 0; at < size;) {
    const size_t bytes = size - at >= 4 ? 4 : (size - at >= 2 ? 2 : 1);
    const uint16_t width = bytes == 4 ? BPF_W : (bytes == 2 ? BPF_H : BPF_B);
    chunks.push_back(
        {width, kChannelOffset + static_cast<uint32_t>(at), NumberAt(channel.c_str(), at, bytes)});
    at += bytes;
  }
  // At most 64 / 4 + 2 chunks of two instructions: the jumps fit into 8 bits.
  const size_t tail = conditional ? 4 : 1;
  for (size_t i = 0; i < chunks.size(); ++i) {
    // To behind this channel's last instruction.
    const size_t after = 2 * (chunks.size() - i - 1) + tail;
    program->push_back(Load(chunks[i].width, chunks[i].offset));
    program->push_back(JumpIfEqual(chunks[i].value, 0, static_cast<uint8_t>(after)));
  }
  if (conditional) {
    // A payload that is too short for the number drops the packet here, as it should.
    const auto payload = kChannelOffset + static_cast<uint32_t>(size);
    program->push_back(Load(interest.width == 2 ? BPF_H : BPF_B, payload + interest.offset));
    program->push_back(
        JumpIfEqual(interest.value, interest.unless ? 0 : 1, interest.unless ? 1 : 0));
    program->push_back(Return(0));
  }
  program->push_back(Return(UINT32_MAX));
}

}  // namespace

std::vector<sock_filter> BuildChannelFilter(std::vector<ChannelInterest> channels,
                                            const ChannelPattern& pattern) {
  // Short names first: comparing with a name never reads beyond packets of names at least as long,
  // so no packet is rejected for its size before its own name had its turn.
  std::sort(channels.begin(), channels.end(),
            [](const ChannelInterest& a, const ChannelInterest& b) {
              const size_t size = a.channel.size();
              return size != b.channel.size() ? size < b.channel.size() : a.channel < b.channel;
            });
  std::vector<sock_filter> program = {Load(BPF_W, kMagicOffset), JumpIfEqual(kLcmShortMagic, 1, 0),
                                      Return(0)};
  for (const ChannelInterest& channel : channels) AppendChannel(channel, &program);
  // What the pattern drops for its size has had its turn by name.
  if (!pattern.prefix.empty() && pattern.suffix.size() >= 4) AppendPattern(pattern, &program);
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
