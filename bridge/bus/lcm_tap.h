#pragma once
// An ear on an LCM bus: hears every message with the time at which it arrived, and sends nothing.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "compiler/base/result.h"

namespace morphbus::bridge {

/// A message as it was heard. The views are valid during the call only.
struct TappedMessage {
  std::string_view channel;
  const uint8_t* data;
  size_t size;
  /// When it arrived at this machine, nanoseconds since 1970: the kernel's time, so that a listener
  /// that is busy sees no jitter but the bus's; of a long message, its last fragment's. Other
  /// providers than udpm give the time at which LCM read it, in microseconds.
  int64_t arrival_ns;
};

/// What an ear missed since it was opened, in messages; all 0 with other providers than udpm.
struct TapLosses {
  int64_t missing = 0;     ///< Gaps in the numbers of LCM's senders, whatever their cause.
  int64_t overflowed = 0;  ///< Of the datagrams: those that found the socket's buffer full.
  int64_t incomplete = 0;  ///< Long messages of which not all fragments came, or too long ones.
  int64_t bad = 0;         ///< Datagrams that are not LCM's.
};

/// Hears everything on a bus, other programs' messages and those of many datagrams too; memory is
/// bounded. For spies; the processes of a run use a Bus, which refuses what is not theirs. Not to
/// be shared between threads.
class LcmTap {
 public:
  using Sink = std::function<void(const TappedMessage& message)>;

  /// Opens an ear on `url` as OpenLcmBus opens a bus. Fails in one sentence.
  static Result<std::unique_ptr<LcmTap>> Open(const std::string& url);
  virtual ~LcmTap() = default;

  /// Hands over what has arrived, some thousands of messages at most; never waits.
  virtual void Take(const Sink& sink) = 0;
  /// The descriptor for poll(): readable when something has arrived.
  [[nodiscard]] virtual int fd() const = 0;
  [[nodiscard]] virtual TapLosses losses() const = 0;
};

}  // namespace morphbus::bridge
