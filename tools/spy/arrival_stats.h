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
  /// `hz` as it was second by second since the second message, oldest first; of the last minute.
  std::vector<double> hz_history;
};

/// The arrivals on one channel; keeps the last 1024 intervals, and the rates of the last minute.
class ArrivalStats {
 public:
  static constexpr int kMost = 1024;
  static constexpr int kMostRates = 60;

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
  /// Messages and payload bytes a second.
  struct Rate {
    double hz = 0.0;
    double bytes_per_s = 0.0;
  };
  /// The `back`-th newest interval, from 0.
  [[nodiscard]] const Interval& Newest(int back) const;
  /// The rate at `now_ns`, which is not before the last arrival.
  [[nodiscard]] Rate RateAt(int64_t now_ns) const;
  /// Appends the rates of all whole seconds up to `now_ns` that `rates` lacks, kMostRates at most.
  /// Returns the next second.
  int64_t FollowRates(int64_t now_ns, std::vector<double>* rates) const;

  std::vector<Interval> intervals_;  ///< A ring once it is full; grows as intervals come.
  int next_ = 0;                     ///< Where in the ring the next one goes.
  int64_t last_ns_ = -1;             ///< The last arrival; -1 before the first.
  std::vector<double> rates_;        ///< Second by second, up to the last arrival.
  int64_t next_rate_ns_ = -1;        ///< When the next of them is due; -1 before the first message.
};

}  // namespace morphbus::tools
