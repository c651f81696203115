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

/// What a bus lost of what was sent to it, and what it did to messages on purpose
/// (bridge/bus/faulty_bus.h), since it began; in messages, if nothing else is said.
struct BusLosses {
  int64_t queue_overflows = 0;  ///< Dropped because the bounded queue (4096) was full.
  int64_t fragments = 0;        ///< Parts of long messages, which no process of ours sends.
  /// Filters that the kernel refused: every message of any program wakes the process from then on.
  int64_t refused_filters = 0;
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

/// The channels that a subscription is for.
struct Channels {
  enum class By : uint8_t {
    kName,    ///< The one with exactly this name.
    kPrefix,  ///< Every one whose name begins so: for loggers and spies.
    /// Every one whose name begins and ends so, of which none wakes: for a process that will need
    /// some and does not know yet which. A bus may deliver none of them, or the first message of
    /// each once that is subscribed to by its name.
    kBothEnds,
  };
  By by = By::kName;
  std::string name;    ///< The whole name, or how names begin.
  std::string suffix;  ///< How they end, for kBothEnds.
  Interest interest;   ///< What is needed of the channel, for kName; of others all is.
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

  /// Receives what these channels carry. Doing so again for the same ones replaces the handler and
  /// the interest.
  virtual void Receive(const Channels& channels, Handler handler) = 0;
  /// The same for channels by their name, by a prefix, and by both ends of their names.
  void Subscribe(const std::string& channel, Handler handler, const Interest& interest = {}) {
    Receive({Channels::By::kName, channel, "", interest}, std::move(handler));
  }
  void SubscribePrefix(const std::string& prefix, Handler handler) {
    Receive({Channels::By::kPrefix, prefix, "", {}}, std::move(handler));
  }
  void SubscribeQuietly(const std::string& prefix, const std::string& suffix, Handler handler) {
    Receive({Channels::By::kBothEnds, prefix, suffix, {}}, std::move(handler));
  }

  /// Drops all subscriptions under this name: of the channel, by the prefix, and by both ends.
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

  /// What was lost on the way to this bus's handlers.
  [[nodiscard]] virtual BusLosses losses() const { return {}; }

  /// Messages dropped unread because they had not the run's key; only a SealedBus looks.
  [[nodiscard]] virtual const UnauthenticCounts& unauthentic() const {
    static const UnauthenticCounts none;
    return none;
  }
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
