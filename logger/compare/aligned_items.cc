// The half of PairComparer (pair_comparer.h) for runs that are not the same tick for tick: they are
// compared by the commands that begin, and by where everything comes to rest in between.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "logger/compare/pair_comparer.h"

namespace morphbus::logger {
namespace {

/// A joint that turns or slides further in one tick moves (rad, m).
constexpr double kMovesRad = 1e-3;
constexpr double kMovesM = 1e-4;

/// Sim times (µs) at which the value moves on from the sample before.
std::vector<int64_t> MovingTimes(const ScalarTrack& track, double moves) {
  std::vector<int64_t> times;
  for (size_t i = 1; i < track.value.size(); ++i) {
    if (std::abs(track.value[i] - track.value[i - 1]) > moves) times.push_back(track.time_us[i]);
  }
  return times;
}

/// Whether a row of times has one from `begin` to `end`.
bool HasTimeIn(const std::vector<int64_t>& times, int64_t begin, int64_t end) {
  const auto found = std::lower_bound(times.begin(), times.end(), begin);
  return found != times.end() && *found <= end;
}

/// Sim times (µs) at which any joint of the robot moves, ascending.
std::vector<int64_t> MovingTimesOf(const RunLog& log) {
  std::vector<int64_t> all;
  for (const ModuleSeries& module : log.modules) {
    if (module.model_index < 0) continue;
    const auto& joints = log.model->TypeOf(*log.robot, module.model_index).joints;
    for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
      const bool slides = joints[j].type == model::JointType::kPrismatic;
      const std::vector<int64_t> times =
          MovingTimes(AngleTrack(module, j, JointSigns(1)), slides ? kMovesM : kMovesRad);
      all.insert(all.end(), times.begin(), times.end());
    }
  }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

}  // namespace

void PairComparer::FindRest() {
  at_rest_.clear();
  const std::vector<int64_t> moves_a = MovingTimesOf(a_);
  const std::vector<int64_t> moves_b = MovingTimesOf(b_);
  // The same thing may happen in one run up to event_s before it happens in the other, so that a
  // tick counts only if nothing moves for so long before and after it.
  for (const int64_t tick : ticks_) {
    if (!HasTimeIn(moves_a, tick - window_us_, tick + window_us_) &&
        !HasTimeIn(moves_b, tick - window_us_, tick + window_us_)) {
      at_rest_.push_back(tick);
    }
  }
  // The link that carries the robot frame in A's model, and the one that answers to it in B.
  base_a_ = base_b_ = PoseTrack();
  for (const ModulePair& pair : out_.matching.pairs) {
    const ModuleSeries& ma = a_.modules[pair.a];
    const ModuleSeries& mb = b_.modules[pair.b];
    if (ma.model_index != a_.robot->root_module) continue;
    for (const LinkPair& link : pair.links) {
      if (link.link_a != a_.robot->root_link) continue;
      base_a_ = PropagatedTrack(ma, link.link_a);
      base_b_ = PropagatedTrack(mb, link.link_b);
      rest_base_a_ = rest_a_[ma.model_index][link.link_a];
      rest_base_b_ = rest_b_[mb.model_index][link.link_b];
      return;
    }
  }
}

bool PairComparer::Rests(int64_t time_us) const {
  return std::binary_search(at_rest_.begin(), at_rest_.end(), time_us);
}

std::vector<bool> PairComparer::RestsAt(const ScalarTrack& track, const Measure& measure) const {
  std::vector<bool> rests(track.value.size(), true);
  if (by_ticks_) return rests;
  const bool slides = measure.quantity == Quantity::kJointTravel;
  const std::vector<int64_t> moves = MovingTimes(track, slides ? kMovesM : kMovesRad);
  for (size_t i = 0; i < rests.size(); ++i) {
    const int64_t time_us = track.time_us[i];
    rests[i] = !HasTimeIn(moves, time_us - window_us_, time_us + window_us_);
  }
  // A joint that never rests is compared all the time.
  const bool ever = std::find(rests.begin(), rests.end(), true) != rests.end();
  if (!ever) rests.assign(rests.size(), true);
  return rests;
}

PoseTrack PairComparer::InBaseFrame(const PoseTrack& track, const PoseTrack& base,
                                    const model::Pose& rest) {
  PoseTrack moved;
  ForCommonTimes(track.time_us, base.time_us, std::numeric_limits<int64_t>::max(),
                 [&](size_t i, size_t j) {
                   // The base is moved to where it lies at rest, and takes the link along.
                   moved.Add(track.time_us[i], rest * base.value[j].inverse() * track.value[i]);
                 });
  return moved;
}

bool PairComparer::NearlyHas(const std::vector<int64_t>& times, int64_t time_us) const {
  return !by_ticks_ && HasTimeIn(times, time_us - window_us_, time_us + window_us_);
}

CountTrack PairComparer::Lasting(CountTrack counts) const {
  // Each stretch of differences is looked at as a whole.
  for (size_t begin = 0; begin < counts.value.size();) {
    size_t end = begin;
    // A difference that is over within event_s only shows that one run was ahead of the other.
    while (end < counts.value.size() && counts.value[end] > 0) ++end;
    const bool brief = end > begin && counts.time_us[end - 1] - counts.time_us[begin] < window_us_;
    if (brief)
      std::fill(counts.value.begin() + static_cast<ptrdiff_t>(begin),
                counts.value.begin() + static_cast<ptrdiff_t>(end), 0);
    begin = end + 1;
  }
  return counts;
}

void PairComparer::CompareStaleness(const Subject& modules) {
  const ScalarTrack a = StalenessTrack(modules.a);
  const ScalarTrack b = StalenessTrack(modules.b);
  // That poses are there at all is compared with the links.
  CountTrack counts;
  ForCommonTimes(a.time_us, b.time_us, out_.compared_until_us, [&](size_t i, size_t j) {
    counts.Add(a.time_us[i], static_cast<int>(std::abs(a.value[i] - b.value[j])));
  });
  if (!by_ticks_) counts = Lasting(std::move(counts));
  Meter meter(&AddItem(modules.names, Quantity::kStaleness, ""));
  for (size_t i = 0; i < counts.value.size(); ++i) meter.Add(counts.time_us[i], counts.value[i]);
}

void PairComparer::CompareCommandStarts(const Subject& of, const JointPair& joint) {
  // Between the commands of B there is B's own time, not the one that was brought onto A's.
  const ModuleSeries& mb = own_b_.modules[of.pair.b];
  const auto a = CommandStarts(of.a, joint.joint_a, SignsOfA(of.a, joint));
  const auto b = CommandStarts(mb, joint.joint_b, SignsOfB(mb, joint));
  const Alignment& alignment = out_.alignment;
  const TimeMap& map = alignment.of_pair[&of.pair - out_.matching.pairs.data()];
  // The n-th command of the joint in A answers to its n-th in B.
  const size_t common = std::min(a.size(), b.size());
  // What each command tells the joint.
  {
    Item& item = AddItem(of.names, Quantity::kSpeedLimit, joint.prismatic ? "m/s" : "rad/s");
    Meter meter(&item);
    for (size_t i = 0; i < common; ++i) {
      if (a[i].command.mode != b[i].command.mode) continue;
      meter.Add(a[i].time_us, std::abs(a[i].command.speed_limit - b[i].command.speed_limit));
    }
  }
  {
    Item& item = AddItem(of.names, Quantity::kCommand, joint.prismatic ? "m" : "rad");
    Meter meter(&item);
    for (size_t i = 0; i < common; ++i) {
      const bool alike = a[i].command.mode == b[i].command.mode;
      const double difference = std::abs(a[i].command.value - b[i].command.value);
      meter.Add(a[i].time_us,
                // Commands of unlike modes differ visibly, whatever their values are.
                alike ? difference : std::max({difference, 2 * item.tolerance, 1e-6}));
    }
  }
  // When each begins: after the one before, and among those of the other modules.
  Item& item = AddItem(of.names, Quantity::kEvent, "s");
  Meter meter(&item);
  int64_t before_a = of.pair.taken_a_us;
  int64_t before_b = own_taken_b_.at(&of.pair);
  for (size_t i = 0; i < common; ++i) {
    const int64_t shift = a[i].time_us - b[i].time_us;
    double off = Seconds(std::abs(shift - alignment.of_robot.ShiftAt(b[i].time_us)));
    if (alignment.how == Align::kEvent && before_a >= 0 && before_b >= 0) {
      off = std::max(off, Seconds(std::abs(shift - (before_a - before_b))));
    }
    meter.Add(a[i].time_us, off);
    before_a = a[i].time_us;
    before_b = b[i].time_us;
  }
  // A command that only one run has, unless the other one ended before it.
  const bool more_a = a.size() > common;
  if (!more_a && b.size() == common) return;
  const int64_t time_us = more_a ? a[common].time_us : map.ToA(b[common].time_us);
  if (time_us > out_.compared_until_us - window_us_) return;
  if (item.detail.empty()) item.detail = fmt::format("only {} goes on", more_a ? "A" : "B");
  meter.Add(time_us, std::max(Seconds(out_.compared_until_us - time_us), 2 * item.tolerance));
}

}  // namespace morphbus::logger
