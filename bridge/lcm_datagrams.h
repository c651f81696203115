#pragma once
// LCM's UDP multicast protocol, receiving side: datagrams to messages. Pure; no socket.

#include <cstdint>
#include <functional>
#include <list>
#include <string>
#include <string_view>
#include <vector>

namespace morphbus::bridge {

/// Puts messages together from datagrams, as the protocol asks ("LCM UDP Multicast Protocol
/// Description" in LCM's manual): short messages ("LC02") are one datagram; longer ones come as
/// fragments ("LC03"), in any order, perhaps twice. Anything else is dropped and counted. Memory is
/// bounded: at most 16 unfinished messages of at most 64 MiB together; the oldest give way.
class LcmDatagrams {
 public:
  using Sink = std::function<void(std::string_view channel, const uint8_t* data, size_t size)>;

  static constexpr size_t kMostUnfinished = 16;
  static constexpr size_t kMostBytes = size_t{64} << 20;

  /// One datagram from `sender` (any number that tells senders apart; sequence numbers are theirs).
  /// Calls `sink` if it finishes a message; the bytes live until the call returns.
  void Take(uint64_t sender, const uint8_t* data, size_t size, const Sink& sink);

  [[nodiscard]] int64_t bad() const { return bad_; }  ///< Datagrams that were no LCM.
  /// Messages given up because fragments of them did not come.
  [[nodiscard]] int64_t abandoned() const { return abandoned_; }

 private:
  struct Unfinished {
    uint64_t sender = 0;
    uint32_t sequence = 0;
    std::string channel;
    std::vector<uint8_t> bytes;
    std::vector<bool> arrived;  ///< By fragment number.
    size_t missing = 0;
  };
  struct Fragment;

  void TakeShort(const uint8_t* data, size_t size, const Sink& sink);
  void TakeFragment(uint64_t sender, const uint8_t* data, size_t size, const Sink& sink);
  std::list<Unfinished>::iterator Find(const Fragment& fragment);
  void MakeRoom(size_t bytes);

  std::list<Unfinished> unfinished_;  ///< Oldest first.
  size_t bytes_held_ = 0;
  int64_t bad_ = 0;
  int64_t abandoned_ = 0;
};

}  // namespace morphbus::bridge
