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
  /// Takes a finished message. The views are valid during the call only.
  using Sink = std::function<void(std::string_view channel, const uint8_t* data, size_t size)>;

  /// Bounds on what is kept for messages that may never be finished.
  static constexpr size_t kMostUnfinished = 16;
  static constexpr size_t kMostBytes = size_t{64} << 20;

  /// One datagram from `sender` (any number that tells senders apart; sequence numbers are theirs).
  /// Calls `sink` if it finishes a message; the bytes live until the call returns.
  void Take(uint64_t sender, const uint8_t* data, size_t size, const Sink& sink);

  /// Datagrams that were not LCM's, or that contradicted themselves or others of their message.
  [[nodiscard]] int64_t bad() const { return bad_; }
  /// Messages given up because fragments of them did not come.
  [[nodiscard]] int64_t abandoned() const { return abandoned_; }

 private:
  /// A message of which fragments are missing.
  struct Unfinished {
    /// Sender and sequence number together tell messages apart.
    uint64_t sender = 0;
    uint32_t sequence = 0;
    std::string channel;
    /// The whole message's size from the beginning; filled as fragments come.
    std::vector<uint8_t> bytes;
    std::vector<bool> arrived;  ///< By fragment number.
    /// Fragments that have not come yet; 0 ends the wait.
    size_t missing = 0;
  };
  /// One datagram of a longer message, taken apart.
  struct Fragment;

  /// A message in one datagram.
  void TakeShort(const uint8_t* data, size_t size, const Sink& sink);
  /// A part of a longer one.
  void TakeFragment(uint64_t sender, const uint8_t* data, size_t size, const Sink& sink);
  /// The unfinished message that a fragment belongs to, begun if need be; end() if the fragment
  /// contradicts those that came before it.
  std::list<Unfinished>::iterator Find(const Fragment& fragment);
  /// Gives up the oldest unfinished messages until so many bytes fit.
  void MakeRoom(size_t bytes);

  std::list<Unfinished> unfinished_;  ///< Oldest first.
  /// The sizes of all unfinished messages together.
  size_t bytes_held_ = 0;
  int64_t bad_ = 0;
  int64_t abandoned_ = 0;
};

}  // namespace morphbus::bridge
