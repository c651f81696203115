#pragma once
// What LCM's own numbers tell of datagrams that were lost, of any program's.

#include <cstddef>
#include <cstdint>
#include <map>

namespace morphbus::bridge {

/// Counts gaps in the numbers that every LCM sender gives its messages on a multicast group, over
/// all channels. They tell what a listener missed of any program's traffic, though not on which
/// channel. Knows 4096 senders at most; of more, those heard least recently are forgotten.
class LcmSenders {
 public:
  static constexpr size_t kMost = 4096;
  /// A datagram of `sender` (any number that tells senders apart) with LCM's number; the fragments
  /// of one message have the same.
  void Take(uint64_t sender, uint32_t sequence);
  /// Messages that are missing so far; one that was only overtaken by others is taken back.
  [[nodiscard]] int64_t lost() const { return lost_; }
  /// Senders that are known now.
  [[nodiscard]] size_t size() const { return senders_.size(); }

 private:
  /// One sender's numbers.
  struct Sender {
    uint32_t highest = 0;
    int64_t lost = 0;
    int64_t heard = 0;  ///< When it was heard last, in datagrams.
  };
  std::map<uint64_t, Sender> senders_;
  int64_t datagrams_ = 0;
  int64_t lost_ = 0;
};

}  // namespace morphbus::bridge
