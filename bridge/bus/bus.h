#pragma once
// The bus: bytes on named channels. Two implementations: LCM over UDP multicast
// (bridge/bus/lcm_bus.h) and our own in-process one (bridge/bus/inproc_bus.h), on which a run gives
// the same payloads.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace morphbus::bridge {

/// Longest name of a channel, bytes: LCM's limit.
inline constexpr size_t kMaxChannelName = 63;

/// What was dropped unread because it had not the run's key (bridge/wire/sealed_bus.h), in
/// messages.
struct UnauthenticCounts {
  int64_t all = 0;
  /// By channel, in order of their first message; those of further channels only the sum has.
  std::vector<std::pair<std::string, int64_t>> channels;
};

/// What a process sent, received, missed and refused since it began; travels in HEALTH. Every
/// authentic message that arrives counts as received or as bad; those that were sound and yet
/// refused count as received, and once more below.
struct Ledger {
  /// Messages accepted, and messages published for the first time.
  int64_t received = 0;
  int64_t sent = 0;
  int64_t lost = 0;       ///< Gaps in sequence numbers, later filled or not.
  int64_t discarded = 0;  ///< Thrown away on purpose (--loss, --faults).
  /// Messages that had come before, messages published again, and requests for such messages.
  int64_t duplicates = 0;
  int64_t resent = 0;
  int64_t asked = 0;
  /// Messages dropped because the own queue was full; messages that could not be decoded, or came
  /// on a channel that the run does not have; and deadlines missed in real time.
  int64_t queue_overflows = 0;
  int64_t bad = 0;
  int64_t missed_deadlines = 0;
  /// Messages that had not the run's key.
  UnauthenticCounts unauthentic;
  /// The sim's: commands on CONTROL that were refused because they had been taken already or came
  /// after a later one, or because they could not be read.
  int64_t old_commands = 0;
  int64_t malformed_commands = 0;
  /// Messages that arrived twice, after later ones, or with flipped bits, on purpose (--faults).
  int64_t doubled = 0;
  int64_t delayed = 0;
  int64_t corrupted = 0;
  /// How often the process was started again after it had died, as the launcher tells it.
  int64_t restarts = 0;
  /// Messages with other bytes under a number that was had, and messages of a tick that is too old
  /// or cannot have begun.
  int64_t conflicts = 0;
  int64_t outside_window = 0;
  int64_t fragments = 0;  ///< Parts of messages longer than a datagram.
  /// Filters that the kernel refused: every message of any program woke the process from then on.
  int64_t refused_filters = 0;
  /// The first message that was refused by one of these three, for people; empty if there was none.
  std::string first_refused;
};

/// What a bus did to messages on purpose since it began (bridge/bus/faulty_bus.h), in messages.
struct InjectedFaults {
  int64_t discarded = 0;  ///< Thrown away.
  int64_t doubled = 0;    ///< Delivered twice.
  int64_t delayed = 0;    ///< Held back until later ones had come; copies count each.
  int64_t corrupted = 0;  ///< Delivered with flipped bits; copies count each.
};

/// What of a channel a subscriber needs, so that the rest need not wake its process. A bus may
/// deliver more, and sooner; it never delivers less.
struct Interest {
  /// False: a message ends no wait in Handle(), but is dispatched before the next one that does, or
  /// when the wait is over.
  bool wakes = true;
  /// Bytes of the number by which messages are told apart, 1 or 2; 0 if all are needed.
  int width = 0;
  /// The place of that number (big-endian) in the payload.
  uint32_t offset = 0;
  /// Only messages with this number are needed, or with `unless` only those with another one.
  uint16_t value = 0;
  bool unless = false;
  bool operator==(const Interest&) const = default;

  /// Whether a message with this payload is needed. One that is too short for the number is not.
  [[nodiscard]] bool Includes(const uint8_t* data, size_t size) const {
    if (width != 1 && width != 2) return true;
    if (size < offset + static_cast<size_t>(width)) return false;
    const int number = width == 1 ? data[offset] : data[offset] << 8 | data[offset + 1];
    return (number == value) != unless;
  }
};

/// One participant's access to the messages of a run. Delivery is as on UDP: a message may be lost,
/// doubled or late, and no party is told. Not to be shared between threads.
class Bus {
 public:
  /// Called from Handle() only, in order of arrival, never from another thread. Must not throw.
  using Handler = std::function<void(std::string_view channel, const uint8_t* data, size_t size)>;

  virtual ~Bus() = default;

  /// Sends one message; at most 63 characters of channel name.
  virtual void Publish(const std::string& channel, const uint8_t* data, size_t size) = 0;

  /// Receives the channel with exactly this name, or what of it is of `interest`. Subscribing again
  /// replaces the handler and the interest.
  virtual void Subscribe(const std::string& channel, Handler handler, const Interest& interest) = 0;
  void Subscribe(const std::string& channel, Handler handler) {
    Subscribe(channel, std::move(handler), Interest());
  }

  /// Receives every channel whose name begins with `prefix` (loggers, spies; wakes for all of
  /// them).
  virtual void SubscribePrefix(const std::string& prefix, Handler handler) = 0;

  /// Receives every channel whose name begins with `prefix` and ends with `suffix`, and wakes for
  /// none of them: for a process that will need some and does not know yet which. A bus may deliver
  /// none, or the first one of each channel once that is subscribed to by its name.
  virtual void SubscribeQuietly(const std::string& /*prefix*/, const std::string& /*suffix*/,
                                Handler /*handler*/) {}

  /// Drops the subscription to a channel or prefix of this name; nothing happens if there is none.
  virtual void Unsubscribe(const std::string& channel) = 0;

  /// While `batch`, changes of subscriptions may wait until it ends: each one may cost the kernel a
  /// filter.
  virtual void BatchSubscriptions(bool /*batch*/) {}

  /// While `any`, every message ends a wait, also one on a channel that otherwise does not: for a
  /// process that waits for one that was lost.
  virtual void WakeForAny(bool /*any*/) {}

  /// Dispatches what has arrived; waits up to `timeout_us` (0: not at all) for the first message
  /// that wakes. Returns the number of messages dispatched.
  virtual int HandleFor(int64_t timeout_us) = 0;
  /// The same, with the limit in milliseconds.
  int Handle(int timeout_ms) { return HandleFor(int64_t{timeout_ms} * 1000); }

  /// Messages dropped because the bounded queue (4096) was full.
  [[nodiscard]] virtual int64_t queue_overflows() const { return 0; }

  /// Fragments of long messages, which no process of ours sends; refused unread.
  [[nodiscard]] virtual int64_t fragments() const { return 0; }

  /// Messages dropped unread because they had not the run's key; only a SealedBus looks.
  [[nodiscard]] virtual const UnauthenticCounts& unauthentic() const {
    static const UnauthenticCounts none;
    return none;
  }

  /// How often the kernel refused to filter what this bus does not need, so that everything on it
  /// wakes the process.
  [[nodiscard]] virtual int64_t refused_filters() const { return 0; }

  /// What was done to messages on purpose; nothing but by a FaultyBus.
  [[nodiscard]] virtual InjectedFaults injected() const { return {}; }
};

/// Changes of subscriptions take effect together, when this is destroyed at the latest.
class SubscriptionBatch {
 public:
  /// `bus` outlives this.
  explicit SubscriptionBatch(Bus* bus) : bus_(bus) { bus_->BatchSubscriptions(true); }
  ~SubscriptionBatch() { bus_->BatchSubscriptions(false); }
  SubscriptionBatch(const SubscriptionBatch&) = delete;
  SubscriptionBatch& operator=(const SubscriptionBatch&) = delete;

 private:
  Bus* bus_;
};

}  // namespace morphbus::bridge
