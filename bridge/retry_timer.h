#pragma once
// Timing of the lockstep's state machines. No clock in here: time is handed in.

#include <algorithm>
#include <cstdint>
#include <limits>

namespace morphbus::bridge {

struct LockstepTiming {
  int64_t ask_after_us = 2000;         ///< First request, then doubling
  int64_t ask_at_most_us = 64000;      ///< to this.
  int64_t end_silence_us = 5'000'000;  ///< After END: who does not acknowledge is named.
  int64_t join_silence_us =
      30'000'000;                       ///< Before tick 0 is over: who does not say HELLO is named.
  int64_t run_silence_us = 60'000'000;  ///< While running: who does not answer is named.
  int64_t lost_us = 10'000'000;         ///< Module, logger: give up after so long without the sim.
  int64_t beat_us = 1'000'000;          ///< CLOCK repeats so often while the sim holds still.
  int64_t linger_us = 1'000'000;        ///< After END_ACK: exit after so much silence, without BYE.
};

/// Fires after 2 ms, then after twice as long each time, up to 64 ms.
class RetryTimer {
 public:
  [[nodiscard]] bool armed() const { return due_us_ != std::numeric_limits<int64_t>::max(); }
  [[nodiscard]] int64_t due_us() const { return due_us_; }
  void Arm(int64_t now_us, const LockstepTiming& timing) {
    interval_us_ = timing.ask_after_us;
    due_us_ = now_us + interval_us_;
  }
  void Disarm() { due_us_ = std::numeric_limits<int64_t>::max(); }
  /// True if due; then set for the next time.
  bool Fire(int64_t now_us, const LockstepTiming& timing) {
    if (now_us < due_us_) return false;
    interval_us_ = std::min(2 * interval_us_, timing.ask_at_most_us);
    due_us_ = now_us + interval_us_;
    return true;
  }

 private:
  int64_t due_us_ = std::numeric_limits<int64_t>::max();
  int64_t interval_us_ = 0;
};

/// How long nothing was heard, as far as we were awake to hear: a process that is stopped (SIGSTOP)
/// and goes on hours later has not been waiting for hours, so a step of time counts as kLongestStep
/// at most.
class SilenceMeter {
 public:
  static constexpr int64_t kLongestStep = 500'000;  ///< µs; poll at least so often.
  void Heard(int64_t now_us) {
    silence_us_ = 0;
    last_us_ = now_us;
  }
  int64_t Poll(int64_t now_us) {
    silence_us_ += std::clamp<int64_t>(now_us - last_us_, 0, kLongestStep);
    last_us_ = std::max(last_us_, now_us);
    return silence_us_;
  }
  [[nodiscard]] int64_t next_poll_us() const { return last_us_ + kLongestStep; }

 private:
  int64_t silence_us_ = 0;
  int64_t last_us_ = 0;
};

}  // namespace morphbus::bridge
