#pragma once
// How regularly the messages of a channel come: rate, bandwidth, jitter.

#include <cstddef>
#include <cstdint>
#include <vector>

namespace morphbus::tools {

/// Figures of the intervals between messages.
struct ArrivalFigures {
  /// Messages and payload bytes a second over the last two seconds, or over the last 8 intervals if
  /// those are longer; 0 once the channel has been silent for a second and for three periods.
  double hz = 0.0;
  double bytes_per_s = 0.0;
  /// Of the last 1024 intervals: how many there are, the median, and by how much the half of them
  /// and 99 % deviate from it at most. Seconds; 0 without intervals.
  int intervals = 0;
  double period_s = 0.0;
  double jitter_p50_s = 0.0;
  double jitter_p99_s = 0.0;
  double silent_s = 0.0;  ///< Since the last message.
};

/// The arrivals on one channel; keeps the last 1024 intervals.
class ArrivalStats {
 public:
  static constexpr int kMost = 1024;

  /// A message of so many payload bytes at `arrival_ns` (any clock). A clock that is set back costs
  /// the interval.
  void Take(int64_t arrival_ns, size_t bytes);

  /// The figures at `now_ns` on the clock of Take. Percentiles are by nearest rank.
  [[nodiscard]] ArrivalFigures At(int64_t now_ns) const;

 private:
  /// The time from one message to the next, and the size of the next one.
  struct Interval {
    float seconds = 0;
    uint32_t bytes = 0;
  };
  /// The `back`-th newest interval, from 0.
  [[nodiscard]] const Interval& Newest(int back) const;

  std::vector<Interval> intervals_;  ///< A ring once it is full; grows as intervals come.
  int next_ = 0;                     ///< Where in the ring the next one goes.
  int64_t last_ns_ = -1;             ///< The last arrival; -1 before the first.
};

}  // namespace morphbus::tools
