#pragma once
// At which moments the ticks of a run begin.

#include <algorithm>
#include <cstdint>
#include <limits>

namespace morphbus::bridge {

/// The pace of a run: how much wall time a tick takes, from a tick on whose beginning is known.
class TickPace {
 public:
  /// @param tick_us  length of a tick, microseconds of sim time.
  /// @param speed    times real time; 0 for as fast as possible.
  TickPace(int32_t tick_us, double speed) : tick_us_(tick_us), speed_(speed) {}

  /// The pace counts from a tick that begins at this wall time.
  void CountFrom(int64_t tick, int64_t start_us) {
    base_tick_ = tick;
    base_us_ = start_us;
  }
  /// Another speed, from the same tick on.
  void SetSpeed(double speed) { speed_ = speed; }
  /// Whether ticks take any wall time at all.
  [[nodiscard]] bool limited() const { return speed_ > 0; }
  /// Wall time at which a tick begins; where the speed is not limited, at any time.
  [[nodiscard]] int64_t StartUs(int64_t tick) const {
    if (!limited()) return std::numeric_limits<int64_t>::min();
    constexpr double kLongestUs = 1e15;  // Thirty years: a slower pace would leave int64_t.
    const double us = static_cast<double>(tick - base_tick_) * tick_us_ / speed_;
    return base_us_ + static_cast<int64_t>(std::min(us, kLongestUs));
  }

 private:
  int32_t tick_us_;
  double speed_;
  int64_t base_tick_ = 0, base_us_ = 0;
};

}  // namespace morphbus::bridge
