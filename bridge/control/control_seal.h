#pragma once
// Who may command a run: whoever has its key, a file that only the run's owner can read.

#include <array>
#include <cstdint>
#include <deque>
#include <morphbus/control_t.hpp>
#include <string>

#include "bridge/bus/bus.h"
#include "compiler/base/result.h"

namespace morphbus::bridge {

/// The secret of one run: whoever has it may do to the run whatever its owner may.
using ControlKey = std::array<uint8_t, 32>;

/// Writes a fresh random key to a new file of mode 0600. Fails if there is such a file already.
Result<void> CreateControlKey(const std::string& path);
/// Reads the key. Fails if the file is not one, or if others than its owner may read it.
Result<ControlKey> ReadControlKey(const std::string& path);

/// The signature: HMAC-SHA-256 (RFC 2104, by OpenSSL) of the counter (8 bytes, big-endian) and the
/// command.
std::array<uint8_t, 32> ControlMac(const ControlKey& key, int64_t counter,
                                   const std::string& command);

/// A message that whoever has the key believes; `counter` is the machine's monotonic clock
/// (MonotonicTime) in microseconds, so that later commands have higher ones whoever gives them.
morphbus::control_t Seal(const ControlKey& key, int64_t counter, const std::string& command);

/// Decides which messages on CONTROL are obeyed, and counts the others in the sim's ledger. Whoever
/// can reach the bus can say anything there, and say again whatever was said before; without the
/// key neither makes the run do anything.
class ControlGuard {
 public:
  enum class Verdict : uint8_t {
    /// Signed, of now, and new: to be obeyed.
    kObey,
    /// Signed and taken before: the same command came again. If it is its sender that repeats it,
    /// numbered anew, it counts as a duplicate; a copy of what went over the bus, as replayed.
    kAgain,
    /// Signed, but a later command came first; whoever gave it may sign it anew.
    kOvertaken,
    /// Signed too long ago, or in the future.
    kLate,
    /// Not signed with this run's key.
    kForged,
    /// Signed by the sim itself.
    kAnswer,
  };
  /// So long after it was signed a command is obeyed, microseconds.
  static constexpr int64_t kFreshUs = 5'000'000;

  /// What is refused is counted in `ledger`, which outlives the guard.
  ControlGuard(const ControlKey& key, Ledger* ledger) : key_(key), ledger_(*ledger) {}

  /// Judges a message; `now_us` is the monotonic clock.
  Verdict Judge(const morphbus::control_t& message, int64_t now_us);

 private:
  // By what a message is judged, and where it is counted.
  ControlKey key_;
  Ledger& ledger_;
  int64_t last_ = 0;  ///< The highest counter that was obeyed.
  /// A command that was obeyed.
  struct Taken {
    int64_t counter = 0;
    /// The highest number on the channel with which it came. Its header is not signed, so the
    /// number serves for counting only.
    int64_t sequence = 0;
  };
  /// The latest ones, oldest first: enough for all of kFreshUs.
  std::deque<Taken> taken_;
};

}  // namespace morphbus::bridge
