#pragma once
// Wall time for people and time limits; never in a payload.

#include <chrono>

namespace morphbus::tools {

/// A stopwatch on the monotonic clock, which no change of the date disturbs. It starts when it is
/// made; assigning a new one starts it again. What it measures differs from run to run, so it is
/// shown to people and limits waiting, but never goes into a message: equal runs have equal hashes.
class WallTimer {
 public:
  /// Seconds of wall time since construction. The value never falls from one call to the next, also
  /// where somebody sets the machine's clock meanwhile.
  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  /// The time of construction.
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace morphbus::tools
