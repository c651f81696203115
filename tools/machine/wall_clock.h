#pragma once
// Wall time for people and time limits; never in a payload.

#include <chrono>

#include "bridge/lockstep/participant.h"
#include "bridge/lockstep/retry_timer.h"

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

/// A stopwatch that stands still while this process does: one that was stopped together with those
/// whom it waits for, or a moment longer, has not waited for them. Of the time between two calls of
/// seconds() half a second counts at most, so it is asked at least twice a second.
class WakingTimer {
 public:
  /// `time` outlives the timer; null: the machine's monotonic clock.
  explicit WakingTimer(const bridge::TimeSource* time = nullptr) : time_(time) {
    waited_.Heard(NowUs());
  }
  /// Seconds since construction in which the process ran.
  [[nodiscard]] double seconds() { return static_cast<double>(waited_.Poll(NowUs())) * 1e-6; }

 private:
  [[nodiscard]] int64_t NowUs() const {
    return time_ != nullptr ? time_->NowUs() : bridge::MonotonicTime().NowUs();
  }
  const bridge::TimeSource* time_;
  bridge::SilenceMeter waited_;
};

}  // namespace morphbus::tools
