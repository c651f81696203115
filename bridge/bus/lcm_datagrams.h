#pragma once
// LCM's UDP multicast protocol, receiving side: datagrams to messages. Pure; no socket.

#include <cstdint>
#include <functional>
#include <string_view>

namespace morphbus::bridge {

/// The first four bytes of a datagram that is a message, "LC02", or a part of one, "LC03".
inline constexpr uint32_t kLcmShortMagic = 0x4c433032;
inline constexpr uint32_t kLcmFragmentMagic = 0x4c433033;

/// Takes messages out of datagrams, as the protocol lays them out ("LCM UDP Multicast Protocol
/// Description" in LCM's manual): a short message ("LC02") is one datagram. Longer ones come as
/// fragments ("LC03"), and a receiver that puts them together must believe the first one's word on
/// how much memory the message needs. Nothing of ours is longer than a datagram, so fragments are
/// refused by their first four bytes. Nothing is kept from one datagram to the next.
class LcmDatagrams {
 public:
  /// Takes a message. The views are valid during the call only.
  using Sink = std::function<void(std::string_view channel, const uint8_t* data, size_t size)>;

  /// Calls `sink` with the message that the datagram holds, if it holds one.
  void Take(const uint8_t* data, size_t size, const Sink& sink);

  /// Datagrams that were not LCM's.
  [[nodiscard]] int64_t bad() const { return bad_; }
  /// Fragments, which were refused unread.
  [[nodiscard]] int64_t fragments() const { return fragments_; }

 private:
  int64_t bad_ = 0;
  int64_t fragments_ = 0;
};

}  // namespace morphbus::bridge
