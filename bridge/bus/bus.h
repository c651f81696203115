#pragma once
// The bus: bytes on named channels. Two implementations: LCM over UDP multicast
// (bridge/bus/lcm_bus.h) and our own in-process one (bridge/bus/inproc_bus.h), on which a run gives
// the same payloads.

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

namespace morphbus::bridge {

/// What a process sent, received, missed and refused since it began; travels in HEALTH. Every
/// message that arrives counts as received or as bad.
struct Ledger {
  /// Messages accepted, and messages published for the first time.
  int64_t received = 0;
  int64_t sent = 0;
  int64_t lost = 0;       ///< Gaps in sequence numbers, later filled or not.
  int64_t discarded = 0;  ///< Thrown away on purpose (--loss).
  /// Messages that had come before, messages published again, and requests for such messages.
  int64_t duplicates = 0;
  int64_t resent = 0;
  int64_t asked = 0;
  /// Messages dropped because the own queue was full, messages that could not be decoded, and
  /// deadlines missed in real time.
  int64_t queue_overflows = 0;
  int64_t bad = 0;
  int64_t missed_deadlines = 0;
  /// The sim's: commands on CONTROL that were refused because they were not signed with the run's
  /// key, came again, were signed too long ago, or could not be read.
  int64_t forged_commands = 0;
  int64_t replayed_commands = 0;
  int64_t late_commands = 0;
  int64_t malformed_commands = 0;
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
};

/// One participant's access to the messages of a run. Delivery is as on UDP: a message may be lost,
/// doubled or late, and nobody is told. Not to be shared between threads.
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

  /// Drops the subscription to a channel or prefix of this name; nothing happens if there is none.
  virtual void Unsubscribe(const std::string& channel) = 0;

  /// While `any`, every message ends a wait, also one on a channel that otherwise does not: for who
  /// waits for one that was lost.
  virtual void WakeForAny(bool /*any*/) {}

  /// Dispatches what has arrived; waits up to `timeout_us` (0: not at all) for the first message
  /// that wakes. Returns the number of messages dispatched.
  virtual int HandleFor(int64_t timeout_us) = 0;
  /// The same, with the limit in milliseconds.
  int Handle(int timeout_ms) { return HandleFor(int64_t{timeout_ms} * 1000); }

  /// Messages dropped because the bounded queue (4096) was full.
  [[nodiscard]] virtual int64_t queue_overflows() const { return 0; }

  /// Messages thrown away on purpose (bridge/bus/bus_adapters.h, LossyBus).
  [[nodiscard]] virtual int64_t discarded() const { return 0; }
};

}  // namespace morphbus::bridge
