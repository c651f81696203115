#include "logger/figures/gait_cycle.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace morphbus::logger {
namespace {

/// The squared difference of a window that repeats, as a part of the variance, at most. YIN takes
/// 0.1 to 0.2 for voices; commands repeat better, and a second frequency with a sixth of the
/// amplitude must still be seen.
constexpr double kMostDifference = 0.05;
/// Differences that are smaller than this part of the variance are rounding.
constexpr double kExact = 1e-9;
/// A lag that explains so much of what the best explains is as good, if it is smaller.
constexpr double kNearlyBest = 0.8;
/// What repeats must last for this part of the time in which anything changes.
constexpr double kLeastShare = 1.0 / 3.0;
/// The shortest lag, ticks: fewer samples do not tell what they repeat.
constexpr int kLeastLag = 4;
/// So many ticks are searched at once. A longer run is searched at its end, in its middle and at
/// its beginning, and what is found there is followed through all of it.
constexpr int kMostTicks = 12'000;

/// By how many ticks a repetition after `lag` may be early or late.
int SlackAt(int lag, int most) { return std::clamp(lag / 25, 1, std::max(1, most)); }

/// One signal over a stretch of ticks, with what makes windows of it quick to judge.
class Track {
 public:
  Track(const Signal& signal, int begin, int end)
      : x_(signal.values.begin() + begin, signal.values.begin() + end),
        tolerance_(signal.tolerance) {
    // Sums of what is near zero lose no digits.
    const double mean = std::accumulate(x_.begin(), x_.end(), 0.0) / static_cast<double>(x_.size());
    for (double& x : x_) x -= mean;
    sum_.resize(x_.size() + 1);
    squares_.resize(x_.size() + 1);
    for (size_t k = 0; k < x_.size(); ++k) {
      sum_[k + 1] = sum_[k] + x_[k];
      squares_[k + 1] = squares_[k] + x_[k] * x_[k];
    }
  }

  [[nodiscard]] int size() const { return static_cast<int>(x_.size()); }
  [[nodiscard]] double at(int k) const { return x_[k]; }
  [[nodiscard]] double tolerance() const { return tolerance_; }

  /// The variance of the ticks from `begin` up to and without `end`.
  [[nodiscard]] double Variance(int begin, int end) const {
    const double n = end - begin;
    const double mean = (sum_[end] - sum_[begin]) / n;
    return std::max(0.0, (squares_[end] - squares_[begin]) / n - mean * mean);
  }

  /// Whether it moves in those ticks by more than its tolerance.
  [[nodiscard]] bool Moves(int begin, int end) const {
    return Variance(begin, end) > 2.0 * tolerance_ * tolerance_;
  }

  /// What a difference is measured by: the variance, but at least what the tolerance allows.
  [[nodiscard]] double Scale(int begin, int end) const {
    return std::max(Variance(begin, end), tolerance_ * tolerance_);
  }

  /// From now on Difference() lets repetitions be early or late by so many ticks.
  void SetSlack(int slack) {
    if (slack == slack_) return;
    slack_ = slack;
    // The least and the largest value around each tick.
    least_ = x_;
    most_ = x_;
    for (int k = 0; k < size(); ++k) {
      for (int i = std::max(0, k - slack); i <= std::min(size() - 1, k + slack); ++i) {
        least_[k] = std::min(least_[k], x_[i]);
        most_[k] = std::max(most_[k], x_[i]);
      }
    }
  }

  /// By how much the value of tick k differs from all around tick k + lag, beyond the tolerance.
  [[nodiscard]] double Difference(int k, int lag) const {
    const double over = x_[k] - most_[k + lag] - tolerance_;
    const double under = least_[k + lag] - x_[k] - tolerance_;
    return std::max({0.0, over, under});
  }

 private:
  std::vector<double> x_, least_, most_;
  std::vector<double> sum_, squares_;
  double tolerance_ = 0.0;
  int slack_ = 0;
};

using Tracks = std::vector<Track>;

/// Ticks from `begin` up to and without `end`.
struct Stretch {
  int begin = 0;
  int end = 0;
  [[nodiscard]] int length() const { return end - begin; }
};

/// The signals that move between two ticks, those that move most first and equal ones once.
Tracks MovingTracks(const std::vector<Signal>& signals, int begin, int end) {
  std::vector<const Signal*> moving;
  for (const Signal& signal : signals) {
    const auto [least, most] =
        std::minmax_element(signal.values.begin() + begin, signal.values.begin() + end);
    // What stays within its tolerance on either side of a value does not move.
    if (*most - *least <= 2.0 * signal.tolerance) continue;
    // Modules of one role are often told the same; a copy would only cost time.
    const bool known = std::any_of(moving.begin(), moving.end(), [&](const Signal* other) {
      return std::equal(signal.values.begin() + begin, signal.values.begin() + end,
                        other->values.begin() + begin);
    });
    if (!known) moving.push_back(&signal);
  }
  Tracks tracks;
  for (const Signal* signal : moving) tracks.emplace_back(*signal, begin, end);
  // Those that move most come first, since they rule a lag out soonest.
  std::stable_sort(tracks.begin(), tracks.end(), [](const Track& a, const Track& b) {
    return a.Variance(0, a.size()) > b.Variance(0, b.size());
  });
  return tracks;
}

/// The longest stretch in which every window of `lag` ticks comes again as the next one, in all
/// tracks, and something moves; empty if there is none.
Stretch LongestRepetition(Tracks* tracks, int lag, int slack) {
  const int size = tracks->front().size();
  const int windows = size - 2 * lag + 1;
  if (windows <= 0) return {};
  std::vector<char> repeats(windows, 1), moves(windows, 0);
  for (Track& track : *tracks) {
    track.SetSlack(slack);
    // The squared differences of a window, kept up to date while it slides.
    double sum = 0.0;
    std::vector<double> squares(size - lag);
    for (int k = 0; k < size - lag; ++k) {
      const double difference = track.Difference(k, lag);
      squares[k] = difference * difference;
    }
    for (int k = 0; k < lag - 1; ++k) sum += squares[k];
    bool any = false;
    for (int k = 0; k < windows; ++k) {
      sum += squares[k + lag - 1];
      if (repeats[k] != 0) {
        const double most = kMostDifference * lag * track.Scale(k, k + 2 * lag);
        // What is left of a sum of which everything was taken away is rounding.
        repeats[k] = sum <= most ? 1 : 0;
        moves[k] |= track.Moves(k, k + 2 * lag) ? 1 : 0;
        any = any || repeats[k] != 0;
      }
      sum -= squares[k];
    }
    // Most lags are none already for the first track.
    if (!any) return {};
  }
  Stretch longest;
  for (int k = 0; k < windows; ++k) {
    if (repeats[k] == 0 || moves[k] == 0) continue;
    const int begin = k;
    while (k + 1 < windows && repeats[k + 1] != 0 && moves[k + 1] != 0) ++k;
    if (k + 2 * lag - begin > longest.length()) longest = {begin, k + 2 * lag};
  }
  return longest;
}

/// The mean squared difference of all tracks, as a part of their variance, between `count` ticks
/// from `a` on and as many from `b` on; without slack or tolerance.
double PlainDifference(const Tracks& tracks, int a, int b, int count) {
  double sum = 0.0;
  for (const Track& track : tracks) {
    double squares = 0.0;
    for (int k = 0; k < count; ++k) {
      const double difference = track.at(a + k) - track.at(b + k);
      squares += difference * difference;
    }
    sum += squares / (count * track.Scale(0, track.size()));
  }
  return sum / static_cast<double>(tracks.size());
}

/// Where `difference(i)` is least for i from `first` to `last`; between two whole numbers by the
/// parabola through the least value and its neighbours, unless that is 0 but for rounding.
template <class Difference>
double LeastBetween(int first, int last, const Difference& difference) {
  int best = first;
  std::vector<double> values(last - first + 1);
  for (int i = first; i <= last; ++i) {
    values[i - first] = difference(i);
    if (values[i - first] < values[best - first]) best = i;
  }
  const double at = values[best - first];
  if (best == first || best == last || at < kExact) return best;
  const double before = values[best - 1 - first], after = values[best + 1 - first];
  const double bend = before - 2.0 * at + after;
  return bend <= 0.0 ? best : best + 0.5 * (before - after) / bend;
}

/// The period near `lag` in parts of a tick: where the signals differ least from themselves, at
/// that lag and then at multiples of it, which show the same error as many times larger.
double Refined(const Tracks& tracks, const Stretch& stretch, int first_lag, int last_lag) {
  const auto difference = [&](int lag) {
    return PlainDifference(tracks, stretch.begin, stretch.begin + lag, stretch.length() - lag);
  };
  double period = LeastBetween(std::max(1, first_lag - 1),
                               std::min(last_lag + 1, stretch.length() - 1), difference);
  for (int multiple = 2; (multiple + 1) * period <= stretch.length();
       multiple += (multiple + 1) / 2) {
    const int around = std::max(2, static_cast<int>(period / 8.0));
    const int guess = static_cast<int>(std::lround(multiple * period));
    const double found = LeastBetween(std::max(1, guess - around),
                                      std::min(guess + around, stretch.length() - 1), difference);
    period = found / multiple;
  }
  return period;
}

/// The first tick at which something changes after everything began to repeat. Windows let a little
/// through that belongs to what came before, such as the end of getting up; and where a robot got
/// up and waits, as it will do in each cycle, no cycle begins.
int FirstTick(Tracks* tracks, const Stretch& stretch, int lag, int slack) {
  int first = stretch.begin;
  for (Track& track : *tracks) {
    track.SetSlack(slack);
    const double most = 0.1 * track.Scale(stretch.begin, stretch.end);
    // The period may be longer than the lag at which the stretch was found, which then lasts for
    // less than two of it.
    const int end = std::min(stretch.begin + lag, stretch.end - lag);
    for (int k = first; k < end; ++k) {
      const double difference = track.Difference(k, lag);
      if (difference * difference > most) first = k + 1;
    }
  }
  for (int k = first + 1; k < stretch.end; ++k) {
    for (const Track& track : *tracks) {
      if (std::abs(track.at(k) - track.at(k - 1)) > 0.01 * track.tolerance()) return k;
    }
  }
  return first;
}

/// When the cycles begin, by where the first one comes again, and the end of the last one.
std::vector<double> Begins(Tracks* tracks, const Stretch& stretch, double period, int slack) {
  const int lag = static_cast<int>(std::lround(period));
  const int first = FirstTick(tracks, stretch, lag, slack);
  std::vector<double> begins = {static_cast<double>(first)};
  while (true) {
    const double next = begins.back() + period;
    // The last tick that repeats is the last at which a cycle can end.
    const int guess = static_cast<int>(std::lround(next));
    if (guess >= stretch.end) break;
    const int count = std::min(lag, stretch.end - guess - slack - 1);
    // A short rest of the run tells less than the period does.
    if (count < std::max(1, lag / 2) || guess - slack - 1 < 0) {
      begins.push_back(next);
      continue;
    }
    // Where the period is as short as the slack, a cycle could begin anew with the one before it.
    const int after = static_cast<int>(std::floor(begins.back())) + 1;
    begins.push_back(
        LeastBetween(std::max(after, guess - slack - 1), guess + slack + 1,
                     [&](int begin) { return PlainDifference(*tracks, first, begin, count); }));
  }
  return begins;
}

/// What a search in one stretch of the run found: the lags that may be the period, and where.
struct Candidate {
  int first_lag = 0, last_lag = 0;
  Stretch stretch;
};

/// Tries every lag. None if no window repeats.
std::optional<Candidate> BestLag(Tracks* tracks, const CycleOptions& options) {
  // A longer lag could not come twice.
  const int longest_lag = tracks->front().size() / 2;
  std::vector<Stretch> found(std::max(0, longest_lag + 1));
  int best = 0;
  for (int lag = kLeastLag; lag <= longest_lag; ++lag) {
    found[lag] = LongestRepetition(tracks, lag, SlackAt(lag, options.slack_ticks));
    best = std::max(best, found[lag].length());
  }
  if (best == 0) return std::nullopt;
  // The smallest lag that is nearly the best, and with it those beside it that are so, too.
  const auto good = [&](int lag) { return found[lag].length() >= kNearlyBest * best; };
  Candidate candidate;
  candidate.first_lag = kLeastLag;
  while (!good(candidate.first_lag)) ++candidate.first_lag;
  candidate.last_lag = candidate.first_lag;
  while (candidate.last_lag < longest_lag && good(candidate.last_lag + 1)) ++candidate.last_lag;
  candidate.stretch = found[(candidate.first_lag + candidate.last_lag) / 2];
  return candidate;
}

/// The ticks between the first and the last change of anything; empty if nothing changes.
Stretch TimeOfChanges(const Tracks& tracks) {
  Stretch changes{tracks.front().size(), 0};
  for (const Track& track : tracks) {
    for (int k = 1; k < track.size(); ++k) {
      if (std::abs(track.at(k) - track.at(k - 1)) <= 0.01 * track.tolerance()) continue;
      changes.begin = std::min(changes.begin, k);
      changes.end = std::max(changes.end, k + 1);
    }
  }
  return changes.length() > 0 ? changes : Stretch{};
}

/// Searches the ticks from `begin` up to and without `end`.
CycleSearch Search(const std::vector<Signal>& signals, int begin, int end,
                   const CycleOptions& options) {
  Tracks tracks = MovingTracks(signals, begin, end);
  if (tracks.empty()) return {{}, "the commands do not change"};
  const std::optional<Candidate> candidate = BestLag(&tracks, options);
  const Stretch time_of_changes = TimeOfChanges(tracks);
  // A car that drives straight on is told so once.
  const std::string none = 2 * time_of_changes.end > tracks.front().size()
                               ? "the commands do not repeat for two whole cycles"
                               : fmt::format("the commands change for the last time at {:.2f} s",
                                             (begin + time_of_changes.end - 1) * options.tick_s);
  if (!candidate) return {{}, none};
  const int changes = time_of_changes.length();
  if (candidate->stretch.length() < kLeastShare * changes) {
    return {{},
            fmt::format("the commands repeat for {:.2f} s only, of {:.2f} s in which they change",
                        candidate->stretch.length() * options.tick_s, changes * options.tick_s)};
  }
  const double period =
      Refined(tracks, candidate->stretch, candidate->first_lag, candidate->last_lag);
  // A long run was searched in part; the same lag repeats in the rest of it, or does not.
  const int lag = static_cast<int>(std::lround(period));
  const int slack = SlackAt(lag, options.slack_ticks);
  const int size = static_cast<int>(signals.front().values.size());
  Stretch stretch = candidate->stretch;
  if (end - begin < size) {
    tracks = MovingTracks(signals, 0, size);
    stretch = LongestRepetition(&tracks, lag, slack);
  }
  FoundCycle cycle;
  cycle.begins = Begins(&tracks, stretch, period, slack);
  // Two whole cycles have three beginnings, the end of the last one among them.
  if (cycle.begins.size() < 3) return {{}, none};
  cycle.period =
      (cycle.begins.back() - cycle.begins.front()) / static_cast<double>(cycle.begins.size() - 1);
  return {cycle, ""};
}

}  // namespace

CycleSearch FindCycle(const std::vector<Signal>& signals, const CycleOptions& options) {
  const int size = signals.empty() ? 0 : static_cast<int>(signals.front().values.size());
  if (size == 0) return {{}, "there are no commands"};
  if (size < 2 * kLeastLag) return {{}, "the run is too short"};
  if (size <= kMostTicks) return Search(signals, 0, size, options);
  CycleSearch last;
  for (const int begin : {size - kMostTicks, (size - kMostTicks) / 2, 0}) {
    CycleSearch found = Search(signals, begin, begin + kMostTicks, options);
    if (found.cycle) return found;
    // What the end of the run says is told, if no part of it has a cycle.
    if (last.why_not.empty()) last = std::move(found);
  }
  return last;
}

std::optional<double> Mismatch(const std::vector<Signal>& signals, double period, int begin,
                               int end, int slack_ticks) {
  const int lag = static_cast<int>(std::lround(period));
  if (end - begin <= lag) return std::nullopt;
  Tracks tracks = MovingTracks(signals, begin, end);
  double squares = 0.0, variance = 0.0;
  for (Track& track : tracks) {
    track.SetSlack(SlackAt(lag, slack_ticks));
    for (int k = 0; k + lag < track.size(); ++k) {
      const double difference = track.Difference(k, lag);
      squares += difference * difference / (track.size() - lag);
    }
    variance += track.Variance(0, track.size());
  }
  if (tracks.empty()) return std::nullopt;
  return squares / variance;
}

}  // namespace morphbus::logger
