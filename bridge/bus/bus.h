#pragma once
// The bus: bytes on named channels. Two implementations: LCM over UDP multicast
// (bridge/bus/lcm_bus.h) and our own in-process one (bridge/bus/inproc_bus.h), on which a run gives
// the same payloads.

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

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

  /// Receives the channel with exactly this name. Subscribing again replaces the handler.
  virtual void Subscribe(const std::string& channel, Handler handler) = 0;

  /// Receives every channel whose name begins with `prefix` (loggers, spies; wakes for all of
  /// them).
  virtual void SubscribePrefix(const std::string& prefix, Handler handler) = 0;

  /// Drops the subscription to a channel or prefix of this name; nothing happens if there is none.
  virtual void Unsubscribe(const std::string& channel) = 0;

  /// Dispatches what has arrived; waits up to `timeout_ms` (0: not at all) for the first message.
  /// Returns the number of messages dispatched.
  virtual int Handle(int timeout_ms) = 0;

  /// Messages dropped because the bounded queue (4096) was full.
  [[nodiscard]] virtual int64_t queue_overflows() const { return 0; }

  /// Messages thrown away on purpose (bridge/bus/bus_adapters.h, LossyBus).
  [[nodiscard]] virtual int64_t discarded() const { return 0; }
};

}  // namespace morphbus::bridge
