#pragma once
// LCM's UDP multicast protocol, receiving side, for listeners to other people's traffic: messages
// that are longer than a datagram, put together within bounds.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace morphbus::bridge {

/// Puts messages together from their fragments ("LC03" in "LCM UDP Multicast Protocol Description"
/// of LCM's manual). Memory grows by what has arrived, never by what a datagram claims, and stays
/// within the limits. Fragments are taken in their order only, as senders send them and one network
/// segment delivers them: a message of which one is missing or overtaken is given up. Nothing of
/// ours is longer than a datagram; the run's own processes refuse fragments unread (LcmDatagrams).
class LcmFragments {
 public:
  /// What is kept at most.
  struct Limits {
    size_t message_bytes = size_t{32} << 20;  ///< Of one message's payload.
    size_t total_bytes = size_t{64} << 20;    ///< Of all payloads that are not whole yet.
    size_t messages = 64;                     ///< Not whole yet: one a sender, as in LCM.
  };
  /// Takes a whole message. The views are valid during the call only.
  using Sink = std::function<void(std::string_view channel, const uint8_t* data, size_t size)>;

  LcmFragments() : LcmFragments(Limits()) {}
  explicit LcmFragments(const Limits& limits) : limits_(limits) {}

  /// Takes a datagram that begins with the magic of a fragment, from `sender` (any number that
  /// tells senders apart); calls `sink` if it makes a message whole.
  void Take(uint64_t sender, const uint8_t* data, size_t size, const Sink& sink);

  /// Messages of which fragments came and which were never whole: a fragment was lost or overtaken,
  /// they are over the limits, or their fragments contradict each other.
  [[nodiscard]] int64_t given_up() const { return given_up_; }
  /// Bytes that are kept now.
  [[nodiscard]] size_t bytes() const { return bytes_; }

 private:
  /// A message of which the first fragments have come.
  struct Partial {
    uint32_t sequence = 0;  ///< LCM's number, the same in all fragments.
    std::string channel;
    std::vector<uint8_t> payload;  ///< As far as it has come.
    size_t size = 0;               ///< Of the whole payload, as the first fragment says.
    uint32_t fragments = 0;        ///< In the message.
    uint32_t next = 0;             ///< The number of the fragment that comes next.
    int64_t begun = 0;             ///< When it began, in messages; the oldest gives way.
  };
  using Partials = std::map<uint64_t, Partial>;

  /// Begins a message with its first fragment. Returns the end if that is not one.
  Partials::iterator Begin(uint64_t sender, const uint8_t* data, size_t size, size_t* header);
  /// Forgets a message; it counts as given up unless it is whole.
  void Drop(Partials::iterator partial, bool whole);
  /// Drops the oldest messages until another `bytes` fit.
  void MakeRoom(size_t bytes, uint64_t except);

  Limits limits_;
  Partials partials_;  ///< By sender.
  size_t bytes_ = 0;
  int64_t begun_ = 0;
  int64_t given_up_ = 0;
  /// Sender and number of the message that was given up last: its other fragments count no more.
  uint64_t refused_sender_ = 0;
  int64_t refused_sequence_ = -1;
};

}  // namespace morphbus::bridge
