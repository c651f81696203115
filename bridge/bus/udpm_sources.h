#pragma once
// The addresses that messages on a loopback come from, and how receivers use them.
//
// Every datagram to a multicast group is copied for every socket in the group before any filter of
// that socket sees it. With a hundred processes nearly all of a run's time goes into copies that
// are dropped. A group's members can name the senders that they listen to, though, which the kernel
// looks at before it copies (RFC 3376, section 3.2: INCLUDE). On a loopback all of 127.0.0.0/8 is
// ours, so the address that a message comes from is chosen by its channel, and a process that needs
// few channels listens to their addresses, and to those that other programs on this machine send
// from. Others see no difference: a member that names no senders, as LCM's own tools, gets
// everything.

#include <netinet/in.h>

#include <bitset>
#include <cstdint>
#include <string_view>
#include <vector>

namespace morphbus::bridge {

/// How many addresses there are. More of them tell channels apart better, but the kernel goes
/// through all that any process listens to for every datagram.
inline constexpr int kNumSources = 64;

/// A set of the addresses, by number.
using SourceSet = std::bitset<kNumSources>;

/// The number of the address for a channel: FNV-1a (Fowler, Noll, Vo) of its name.
inline int SourceOf(std::string_view channel) {
  uint32_t hash = 2166136261;
  for (const char c : channel) hash = (hash ^ static_cast<uint8_t>(c)) * 16777619;
  return static_cast<int>((hash ^ hash >> 16) % kNumSources);
}

/// 127.76.67.1 and those that follow (LC in ASCII), in network byte order.
inline in_addr SourceAddress(int source) {
  return {htonl(0x7f4c4301U + static_cast<uint32_t>(source))};
}

/// What programs send from that know nothing of all this, LCM itself for one: no address at all,
/// which the kernel chooses where the machine has none but the loopback's, or one that the machine
/// has now.
std::vector<in_addr> OtherSources();

}  // namespace morphbus::bridge
