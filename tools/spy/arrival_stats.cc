#include "tools/spy/arrival_stats.h"

#include <algorithm>
#include <cmath>

namespace morphbus::tools {
namespace {

// Over how much of the past a rate is taken: long enough to be steady, short enough to follow.
constexpr double kRateSeconds = 2.0;
constexpr int kLeastIntervals = 8;

/// The smallest of the values that a share of them does not exceed (nearest rank). Reorders them.
float Percentile(std::vector<float>* values, double share) {
  const auto rank = static_cast<ptrdiff_t>(std::ceil(share * static_cast<double>(values->size())));
  const auto place = values->begin() + std::max<ptrdiff_t>(0, rank - 1);
  std::nth_element(values->begin(), place, values->end());
  return *place;
}

}  // namespace

void ArrivalStats::Take(int64_t arrival_ns, size_t bytes) {
  const int64_t before_ns = last_ns_;
  last_ns_ = arrival_ns;
  // The first message ends no interval, and a clock that was set back makes none.
  if (before_ns < 0 || arrival_ns < before_ns) return;
  const Interval interval = {static_cast<float>(static_cast<double>(arrival_ns - before_ns) * 1e-9),
                             static_cast<uint32_t>(std::min<size_t>(bytes, UINT32_MAX))};
  // The ring grows until it is full, so that a channel with few messages costs little.
  if (intervals_.size() < static_cast<size_t>(kMost)) {
    intervals_.push_back(interval);
  } else {
    intervals_[next_] = interval;
  }
  next_ = (next_ + 1) % kMost;
}

const ArrivalStats::Interval& ArrivalStats::Newest(int back) const {
  return intervals_[(next_ - 1 - back + 2 * kMost) % kMost];
}

ArrivalFigures ArrivalStats::At(int64_t now_ns) const {
  ArrivalFigures figures;
  if (last_ns_ >= 0 && now_ns > last_ns_) {
    figures.silent_s = static_cast<double>(now_ns - last_ns_) * 1e-9;
  }
  figures.intervals = static_cast<int>(intervals_.size());
  if (intervals_.empty()) return figures;
  // Jitter: deviations from the median interval.
  std::vector<float> values;
  values.reserve(intervals_.size());
  for (const Interval& interval : intervals_) values.push_back(interval.seconds);
  const float period = Percentile(&values, 0.5);
  for (float& value : values) value = std::fabs(value - period);
  figures.period_s = period;
  figures.jitter_p50_s = Percentile(&values, 0.5);
  figures.jitter_p99_s = Percentile(&values, 0.99);
  // Rate: whole intervals, so that it is right also where few messages come.
  double seconds = 0.0;
  double bytes = 0.0;
  int count = 0;
  while (count < figures.intervals && (count < kLeastIntervals || seconds < kRateSeconds)) {
    seconds += Newest(count).seconds;
    bytes += Newest(count).bytes;
    ++count;
  }
  const bool silent = figures.silent_s > 1.0 && figures.silent_s > 3.0 * seconds / count;
  if (seconds <= 0.0 || silent) return figures;
  // The interval's message is the one at its end, so that as many messages came as there are
  // intervals.
  figures.hz = count / seconds;
  figures.bytes_per_s = bytes / seconds;
  return figures;
}

}  // namespace morphbus::tools
