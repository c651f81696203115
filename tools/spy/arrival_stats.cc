#include "tools/spy/arrival_stats.h"

#include <algorithm>
#include <cmath>

namespace morphbus::tools {
namespace {

// Over how much of the past a rate is taken: long enough to be steady, short enough to follow.
constexpr double kRateSeconds = 2.0;
constexpr int kLeastIntervals = 8;
// How far apart the rates of the history are.
constexpr int64_t kRateStepNs = 1'000'000'000;

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
  // What was due before this message knows nothing of it. A clock that is set back begins anew.
  if (before_ns < 0 || arrival_ns < before_ns) {
    next_rate_ns_ = arrival_ns + kRateStepNs;
  } else {
    next_rate_ns_ = FollowRates(arrival_ns, &rates_);
  }
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

ArrivalStats::Rate ArrivalStats::RateAt(int64_t now_ns) const {
  if (intervals_.empty()) return {};
  // Whole intervals, so that it is right also where few messages come.
  const int intervals = static_cast<int>(intervals_.size());
  double seconds = 0.0;
  double bytes = 0.0;
  int count = 0;
  while (count < intervals && (count < kLeastIntervals || seconds < kRateSeconds)) {
    seconds += Newest(count).seconds;
    bytes += Newest(count).bytes;
    ++count;
  }
  const double silent_s = std::max(0.0, static_cast<double>(now_ns - last_ns_) * 1e-9);
  const bool silent = silent_s > 1.0 && silent_s > 3.0 * seconds / count;
  if (seconds <= 0.0 || silent) return {};
  // The interval's message is the one at its end, so that as many messages came as there are
  // intervals.
  return {count / seconds, bytes / seconds};
}

int64_t ArrivalStats::FollowRates(int64_t now_ns, std::vector<double>* rates) const {
  // After a long silence only the seconds count that are kept.
  const int64_t due = (now_ns - next_rate_ns_) / kRateStepNs;
  int64_t next_ns = next_rate_ns_ + std::max<int64_t>(0, due - kMostRates) * kRateStepNs;
  for (; next_ns <= now_ns; next_ns += kRateStepNs) rates->push_back(RateAt(next_ns).hz);
  if (rates->size() > static_cast<size_t>(kMostRates)) {
    rates->erase(rates->begin(), rates->end() - kMostRates);
  }
  return next_ns;
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
  // The rate now, and how it came to be.
  const Rate rate = RateAt(now_ns);
  figures.hz = rate.hz;
  figures.bytes_per_s = rate.bytes_per_s;
  figures.hz_history = rates_;
  FollowRates(now_ns, &figures.hz_history);
  return figures;
}

}  // namespace morphbus::tools
