#include "logger/compare/alignment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "compiler/base/text.h"

namespace morphbus::logger {
namespace {

/// Commands that differ by less are the same (rad or m): floats of the program, converted.
constexpr double kSameCommand = 1e-6;
/// The largest lag that is looked for, µs.
constexpr int64_t kLargestLagUs = 30'000'000;
/// Of one joint; at 20 ms a day and more.
constexpr int64_t kMostSteps = 5'000'000;
/// So many events around one tell how far the robot as a whole is shifted.
constexpr int kNeighbours = 8;

/// One event in both runs.
struct SharedEvent {
  int64_t a_us = 0;
  int64_t b_us = 0;
  [[nodiscard]] int64_t shift() const { return a_us - b_us; }
};

bool EarlierInB(const SharedEvent& x, const SharedEvent& y) {
  return x.b_us != y.b_us ? x.b_us < y.b_us : x.a_us < y.a_us;
}

/// The middle one of some values, which must not be none.
int64_t Median(std::vector<int64_t> values) {
  const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The n-th command of one is the n-th of the other, as long as they are the same; and the role.
std::vector<SharedEvent> SharedEvents(const RunLog& a, const RunLog& b, const ModulePair& pair) {
  // Taking the role counts, too: a module whose joints are told nothing has no other event.
  std::vector<SharedEvent> events;
  if (pair.taken_a_us >= 0 && pair.taken_b_us >= 0) {
    events.push_back({pair.taken_a_us, pair.taken_b_us});
  }
  for (const JointPair& joint : pair.joints) {
    const ModuleSeries& ma = a.modules[pair.a];
    const ModuleSeries& mb = b.modules[pair.b];
    const auto in_a = CommandStarts(ma, joint.joint_a, SignsOfA(ma, joint));
    const auto in_b = CommandStarts(mb, joint.joint_b, SignsOfB(mb, joint));
    for (size_t i = 0; i < std::min(in_a.size(), in_b.size()); ++i) {
      if (CommandDifference(in_a[i].command, in_b[i].command) > kSameCommand) break;
      events.push_back({in_a[i].time_us, in_b[i].time_us});
    }
  }
  std::sort(events.begin(), events.end(), EarlierInB);
  return events;
}

/// The map of the robot as a whole: at each event the median of the shifts around it.
TimeMap MapOfRobot(const std::vector<SharedEvent>& events) {
  TimeMap map;
  const int count = static_cast<int>(events.size());
  for (int i = 0; i < count; ++i) {
    std::vector<int64_t> shifts;
    // The median passes over a module that is early or late by itself.
    for (int j = std::max(0, i - kNeighbours); j <= std::min(count - 1, i + kNeighbours); ++j) {
      shifts.push_back(events[j].shift());
    }
    map.Add(events[i].b_us, events[i].b_us + Median(std::move(shifts)));
  }
  return map;
}

/// The values of both runs' joints at every `step` of sim time, those of a joint beside each other.
class JointGrid {
 public:
  JointGrid(const RunLog& a, const RunLog& b, const Matching& matching, int64_t step_us) {
    for (const ModulePair& pair : matching.pairs) {
      for (const JointPair& joint : pair.joints) {
        const ModuleSeries& ma = a.modules[pair.a];
        const ModuleSeries& mb = b.modules[pair.b];
        rows_.push_back({Sampled(AngleTrack(ma, joint.joint_a, SignsOfA(ma, joint)), step_us),
                         Sampled(AngleTrack(mb, joint.joint_b, SignsOfB(mb, joint)), step_us)});
      }
    }
  }

  /// The mean square difference if B is shifted by so many steps; infinite if the runs then have
  /// less than half of the shorter one in common.
  [[nodiscard]] double Cost(int64_t shift) const {
    double sum = 0.0;
    int64_t count = 0;
    int64_t shorter = 0;
    for (const Row& row : rows_) {
      const auto in_a = static_cast<int64_t>(row.a.size());
      const auto in_b = static_cast<int64_t>(row.b.size());
      shorter += std::min(in_a, in_b);
      const int64_t end = std::min(in_a, in_b + shift);
      for (int64_t i = std::max<int64_t>(0, shift); i < end; ++i) {
        const double d = row.a[i] - row.b[i - shift];
        sum += d * d;
        ++count;
      }
    }
    if (count == 0 || 2 * count < shorter) return std::numeric_limits<double>::infinity();
    return sum / static_cast<double>(count);
  }

 private:
  struct Row {
    std::vector<double> a, b;
  };
  /// The last value at or before each step; before the first sample its value.
  static std::vector<double> Sampled(const ScalarTrack& track, int64_t step_us) {
    std::vector<double> values;
    // A damaged log may tell any time; no run has so many steps.
    if (track.value.empty() || step_us <= 0 || track.time_us.back() / step_us > kMostSteps)
      return values;
    size_t at = 0;
    for (int64_t t = 0; t <= track.time_us.back(); t += step_us) {
      while (at + 1 < track.time_us.size() && track.time_us[at + 1] <= t) ++at;
      values.push_back(track.value[at]);
    }
    return values;
  }
  std::vector<Row> rows_;
};

/// The shift of least cost among those around `middle`, in steps; of equals the one nearest to 0.
int64_t BestShift(const JointGrid& grid, int64_t middle, int64_t reach) {
  int64_t best = middle;
  double least = std::numeric_limits<double>::infinity();
  for (int64_t shift = middle - reach; shift <= middle + reach; ++shift) {
    const double cost = grid.Cost(shift);
    if (cost > least || (cost == least && std::abs(shift) >= std::abs(best))) continue;
    // Where the runs have too little in common the shift is no candidate.
    if (cost == std::numeric_limits<double>::infinity()) continue;
    best = shift;
    least = cost;
  }
  return best;
}

/// The lag of B at which the joints move alike: coarsely over the whole reach, then by ticks.
int64_t BestLag(const RunLog& a, const RunLog& b, const Matching& matching) {
  // A log without CLOCK has ticks of no length, by which nothing can be divided.
  const int64_t tick_us = std::max<int64_t>(a.tick_us, 1000);
  // Coarse steps are such that a long run costs no more than a short one.
  const int64_t length_us = std::max(a.ticks_us.back(), b.ticks_us.back());
  const int64_t coarse = std::clamp<int64_t>(length_us / (2000 * tick_us), 5, 50);
  const int64_t found =
      BestShift(JointGrid(a, b, matching, coarse * tick_us), 0, kLargestLagUs / (coarse * tick_us));
  return BestShift(JointGrid(a, b, matching, tick_us), found * coarse, coarse) * tick_us;
}

/// Gives every sample its new time; those that would come before the one before are left out.
template <class Sample, class Map>
void Retime(std::vector<Sample>* samples, bool unique, const Map& map) {
  std::vector<Sample> kept;
  kept.reserve(samples->size());
  for (Sample& sample : *samples) {
    const int64_t time_us = map(sample.time_us);
    if (!kept.empty() && time_us < kept.back().time_us) continue;
    // Of two samples of one time the later one is from after the event that moved it there.
    if (unique && !kept.empty() && time_us == kept.back().time_us) kept.pop_back();
    sample.time_us = time_us;
    kept.push_back(std::move(sample));
  }
  *samples = std::move(kept);
}

/// True if both runs are lockstep runs whose poses spread from modules that answer to each other.
bool SameRules(const RunLog& a, const RunLog& b, const Matching& matching) {
  if (a.facts.mode == "realtime" || b.facts.mode == "realtime" || a.tick_us != b.tick_us) {
    return false;
  }
  return std::any_of(matching.pairs.begin(), matching.pairs.end(), [&](const ModulePair& pair) {
    return a.modules[pair.a].name == a.facts.root_module &&
           b.modules[pair.b].name == b.facts.root_module;
  });
}

}  // namespace

const char* AlignName(Align align) {
  static constexpr const char* kNames[] = {"tick", "event", "lag"};
  return kNames[static_cast<int>(align)];
}

double CommandDifference(const JointCommand& a, const JointCommand& b) {
  if (a.mode != b.mode) return std::numeric_limits<double>::infinity();
  return std::max(std::abs(a.value - b.value), std::abs(a.speed_limit - b.speed_limit));
}

std::vector<CommandStart> CommandStarts(const ModuleSeries& module, int joint,
                                        const JointSigns& signs) {
  std::vector<CommandStart> starts;
  const Track<JointCommand> commands = CommandsOf(module, joint, signs);
  // What a joint is told before its module has a role is where it stands.
  for (size_t i = 1; i < commands.value.size(); ++i) {
    if (CommandDifference(commands.value[i - 1], commands.value[i]) <= kSameCommand) continue;
    starts.push_back({commands.time_us[i], commands.value[i]});
  }
  return starts;
}

void TimeMap::Add(int64_t b_us, int64_t a_us) {
  if (!anchors_.empty() && (b_us <= anchors_.back().b_us || a_us <= anchors_.back().a_us)) return;
  anchors_.push_back({b_us, a_us});
}

int64_t TimeMap::ToA(int64_t b_us) const {
  if (anchors_.empty()) return b_us;
  const auto after = std::ranges::upper_bound(anchors_, b_us, {}, &Anchor::b_us);
  // Before the first event its shift holds.
  const Anchor& anchor = after == anchors_.begin() ? *after : *(after - 1);
  const int64_t time_us = b_us + anchor.a_us - anchor.b_us;
  // Time before an event stays before it, also where the shift becomes smaller there.
  return after == anchors_.end() || after == anchors_.begin() ? time_us
                                                              : std::min(time_us, after->a_us - 1);
}

Alignment FindAlignment(const RunLog& a, const RunLog& b, const Matching& matching, Align how) {
  Alignment alignment;
  alignment.how = how;
  alignment.of_pair.resize(matching.pairs.size());
  if (how == Align::kTick) return alignment;
  // What both runs have in common, module by module and all together.
  std::vector<SharedEvent> all;
  for (size_t p = 0; p < matching.pairs.size(); ++p) {
    const std::vector<SharedEvent> events = SharedEvents(a, b, matching.pairs[p]);
    for (const SharedEvent& event : events) {
      if (how == Align::kEvent) alignment.of_pair[p].Add(event.b_us, event.a_us);
    }
    all.insert(all.end(), events.begin(), events.end());
  }
  std::sort(all.begin(), all.end(), EarlierInB);
  alignment.events = static_cast<int64_t>(all.size());
  // How far the shifts lie apart tells the reader how much the runs stray from each other in time.
  std::vector<int64_t> shifts;
  for (const SharedEvent& event : all) shifts.push_back(event.shift());
  if (!shifts.empty()) {
    alignment.least_shift_us = *std::min_element(shifts.begin(), shifts.end());
    alignment.most_shift_us = *std::max_element(shifts.begin(), shifts.end());
    alignment.lag_us = Median(shifts);
  }
  alignment.of_robot = MapOfRobot(all);
  if (how == Align::kLag) {
    alignment.lag_us = BestLag(a, b, matching);
    alignment.of_robot = TimeMap();
    alignment.of_robot.Add(0, alignment.lag_us);
    alignment.of_pair.assign(matching.pairs.size(), alignment.of_robot);
  }
  // Runs of which every event is in the same tick are the same tick for tick, or they differ.
  alignment.by_ticks = SameRules(a, b, matching) && alignment.lag_us == 0 &&
                       alignment.least_shift_us == 0 && alignment.most_shift_us == 0;
  return alignment;
}

RunLog Aligned(const RunLog& a, const RunLog& b, const Matching& matching,
               const Alignment& alignment) {
  RunLog log = b;
  // On A's ticks, so that what belongs together has one time.
  const int64_t tick_us = std::max<int64_t>(a.tick_us, 1);
  const auto on = [tick_us](const TimeMap& map) {
    return [&map, tick_us](int64_t time_us) {
      const int64_t mapped = map.ToA(time_us) + tick_us / 2;
      const int64_t down = mapped >= 0 ? mapped / tick_us : -((tick_us - 1 - mapped) / tick_us);
      return down * tick_us;
    };
  };
  // A module without a counterpart goes with the robot as a whole.
  std::vector<const TimeMap*> maps(log.modules.size(), &alignment.of_robot);
  for (size_t p = 0; p < matching.pairs.size(); ++p) {
    maps[matching.pairs[p].b] = &alignment.of_pair[p];
  }
  for (size_t m = 0; m < log.modules.size(); ++m) {
    ModuleSeries& module = log.modules[m];
    const auto map = on(*maps[m]);
    // Of each kind a module has one sample a tick, but for STATUS, of which it may send several.
    Retime(&module.sensors, true, map);
    Retime(&module.transforms, true, map);
    Retime(&module.actuators, true, map);
    Retime(&module.status, false, map);
    const auto lost = log.facts.lost_modules.find(module.name);
    if (lost != log.facts.lost_modules.end()) lost->second = map(lost->second);
  }
  const auto map = on(alignment.of_robot);
  Retime(&log.world, true, map);
  for (int64_t& tick : log.ticks_us) tick = map(tick);
  log.ticks_us.erase(std::unique(log.ticks_us.begin(), log.ticks_us.end()), log.ticks_us.end());
  for (LogDamage& damage : log.facts.damage) damage.time_us = map(damage.time_us);
  log.tick_us = a.tick_us;
  return log;
}

std::string AlignmentText(const Alignment& alignment) {
  if (alignment.how == Align::kTick) return "aligned by sim time";
  if (alignment.by_ticks) {
    return fmt::format(
        "aligned by {}: all {} happen in the same ticks, which are compared one by one",
        AlignName(alignment.how), Counted(alignment.events, "event"));
  }
  if (alignment.how == Align::kLag) {
    return fmt::format("aligned by lag: B's times plus {:.3f} s", Seconds(alignment.lag_us));
  }
  return fmt::format("aligned by {}: B's times plus {:.3f} to {:.3f} s",
                     Counted(alignment.events, "event"), Seconds(alignment.least_shift_us),
                     Seconds(alignment.most_shift_us));
}

}  // namespace morphbus::logger
