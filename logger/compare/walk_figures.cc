#include "logger/compare/walk_figures.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>
#include <tuple>

namespace morphbus::logger {
namespace {

/// Targets that differ less are one (rad or m): floats of the wire, converted.
constexpr double kSameTarget = 1e-6;

/// The events of every joint that is told anything.
std::vector<std::vector<CommandEvent>> EventsOfJoints(const RunLog& log) {
  std::vector<std::vector<CommandEvent>> all;
  for (const ModuleSeries& module : log.modules) {
    const size_t joints = module.actuators.empty() ? 0 : module.actuators.front().joints.size();
    for (size_t j = 0; j < joints; ++j) {
      std::vector<CommandEvent> events;
      for (const ActuatorSample& sample : module.actuators) {
        if (j >= sample.joints.size() ||
            sample.joints[j].mode != morphbus::joint_command_t::MODE_POSITION) {
          continue;
        }
        const double target = sample.joints[j].target_si;
        // A command that repeats the last target tells the joint nothing new.
        if (!events.empty() && std::abs(events.back().target - target) < kSameTarget) continue;
        events.push_back({sample.time_us, target});
      }
      if (!events.empty()) all.push_back(std::move(events));
    }
  }
  return all;
}

/// Does what this joint is told after the first period repeat what it was told a period before?
bool Keeps(const std::vector<CommandEvent>& events, const Period& period, int64_t slack_us) {
  return std::all_of(events.begin(), events.end(), [&](const CommandEvent& event) {
    const int64_t before_us = event.time_us - period.period_us;
    if (before_us < period.first_us + slack_us) return true;
    return std::any_of(events.begin(), events.end(), [&](const CommandEvent& other) {
      return std::abs(other.target - event.target) < kSameTarget &&
             std::abs(other.time_us - before_us) <= slack_us;
    });
  });
}

/// The periods of the joints, those that travel most (rad or m) first; equal ones once. What
/// decides between joints of equal travel is their commands and not their place among the modules:
/// congruent robots number their modules differently.
std::vector<Period> Candidates(const std::vector<std::vector<CommandEvent>>& all,
                               int64_t slack_us) {
  // Travel is rounded, so that sums of the same targets in another order compare equal.
  std::set<std::tuple<int64_t, int64_t, int64_t>> candidates;
  for (const std::vector<CommandEvent>& events : all) {
    const std::optional<Period> period = FindPeriod(events, slack_us);
    if (!period) continue;
    double travel = 0.0;
    for (size_t i = 1; i < events.size(); ++i) {
      travel += std::abs(events[i].target - events[i - 1].target);
    }
    candidates.emplace(-std::llround(travel / kSameTarget), period->first_us, period->period_us);
  }
  std::vector<Period> periods;
  for (const auto& [travel, first_us, period_us] : candidates) {
    periods.push_back({period_us, first_us});
  }
  return periods;
}

/// How far the times of repeated commands may be off: two ticks, and in real time, where nobody
/// waits for who is late, some more.
int64_t SlackOf(const RunLog& log) {
  constexpr int64_t kRealtimeSlackUs = 150'000;
  const int64_t two_ticks = 2 * int64_t{log.tick_us};
  return log.facts.mode == "realtime" ? std::max(two_ticks, kRealtimeSlackUs) : two_ticks;
}

/// Whether event i comes again n events later, one period after it.
bool Repeats(const std::vector<CommandEvent>& events, size_t i, size_t n, int64_t slack_us,
             int64_t period_us) {
  return std::abs(events[i].target - events[i + n].target) < kSameTarget &&
         std::abs(events[i + n].time_us - events[i].time_us - period_us) <= slack_us;
}

}  // namespace

std::vector<TrackedPose> TrackOf(const RunLog& log, const TrackedBody& body) {
  // X_WP = X_WL * X_LP, the link's pose as WORLD has it.
  const Eigen::Quaterniond q_LP(body.X_LP.linear());
  std::vector<TrackedPose> track;
  for (const WorldSample& world : log.world) {
    for (const morphbus::body_pose_t& pose : world.bodies) {
      if (pose.module_id != body.link.module || pose.link != body.link.link) continue;
      const double* q = pose.orientation_wxyz;
      const Eigen::Quaterniond q_WL(q[0], q[1], q[2], q[3]);
      const Eigen::Vector3d p_WL(pose.position_m[0], pose.position_m[1], pose.position_m[2]);
      track.push_back({world.time_us, p_WL + q_WL * body.X_LP.translation(), q_WL * q_LP});
    }
  }
  return track;
}

const TrackedPose& PoseAt(const std::vector<TrackedPose>& track, int64_t time_us) {
  const auto found =
      std::lower_bound(track.begin(), track.end(), time_us,
                       [](const TrackedPose& s, int64_t t) { return s.time_us < t; });
  return found == track.end() ? track.back() : *found;
}

double TurnBetween(const TrackedPose& a, const TrackedPose& b) {
  const Eigen::Vector3d north = (b.q * a.q.conjugate()) * Eigen::Vector3d::UnitX();
  return std::atan2(-north.z(), north.x());  // north is x, east is z, up is y
}

std::optional<Period> FindGait(const RunLog& log) {
  constexpr size_t kMostTried = 64;  // robots of thousands of joints have few different ones
  const std::vector<std::vector<CommandEvent>> all = EventsOfJoints(log);
  const int64_t slack_us = SlackOf(log);
  std::vector<Period> candidates = Candidates(all, slack_us);
  if (candidates.size() > kMostTried) candidates.resize(kMostTried);
  // A joint may repeat sooner than the whole robot does; its period is then not kept by the others.
  const auto kept = std::find_if(candidates.begin(), candidates.end(), [&](const Period& period) {
    return std::all_of(all.begin(), all.end(),
                       [&](const auto& events) { return Keeps(events, period, slack_us); });
  });
  return kept == candidates.end() ? std::nullopt : std::optional(*kept);
}

std::vector<int64_t> CycleTimes(const RunLog& log, const Period& period) {
  if (period.period_us <= 0 || log.ticks_us.empty()) return {};
  const std::vector<std::vector<CommandEvent>> all = EventsOfJoints(log);
  const int64_t slack_us = SlackOf(log);
  // The joint whose command begins the period leads; its event of that time tells the target.
  const std::vector<CommandEvent>* leader = nullptr;
  double target = 0.0;
  for (const std::vector<CommandEvent>& events : all) {
    const std::optional<Period> own = FindPeriod(events, slack_us);
    if (!own || own->first_us != period.first_us || own->period_us != period.period_us) continue;
    const auto first = std::find_if(events.begin(), events.end(), [&](const CommandEvent& event) {
      return event.time_us == period.first_us;
    });
    leader = &events;
    target = first->target;
    break;
  }
  // Each cycle ends where the same command comes again, a period later; the last one may end
  // without it if the run does not go on for that long.
  std::vector<int64_t> times = {period.first_us};
  while (times.back() + period.period_us <= log.ticks_us.back()) {
    int64_t next = times.back() + period.period_us;
    int64_t nearest = slack_us + 1;
    for (size_t i = 0; leader != nullptr && i < leader->size(); ++i) {
      const CommandEvent& event = (*leader)[i];
      const int64_t off = std::abs(event.time_us - times.back() - period.period_us);
      if (std::abs(event.target - target) >= kSameTarget || off >= nearest) continue;
      nearest = off;
      next = event.time_us;
    }
    times.push_back(next);
  }
  return times;
}

std::optional<Period> FindPeriod(const std::vector<CommandEvent>& events, int64_t slack_us) {
  // The shortest n for which the last events repeat those n before them, counted back from the end:
  // the beginning of a run, getting up, does not repeat.
  for (size_t n = 1; 2 * n <= events.size(); ++n) {
    const size_t last = events.size() - 1;
    const int64_t period_us = events[last].time_us - events[last - n].time_us;
    size_t first = events.size() - n;  // of the part that repeats, counted down
    while (first > 0 && Repeats(events, first - 1, n, slack_us, period_us)) --first;
    // Two whole periods: the part holds at least 2 n events.
    if (events.size() - first >= 2 * n) return Period{period_us, events[first].time_us};
  }
  return std::nullopt;
}

std::optional<Eigen::Vector3d> MeasureDisplacement(const RunLog& log, const TrackedBody& body) {
  const std::vector<TrackedPose> track = TrackOf(log, body);
  if (track.empty()) return std::nullopt;
  return track.back().p - track.front().p;
}

std::optional<WalkFigures> MeasureWalk(const RunLog& log, const TrackedBody& body) {
  const std::vector<TrackedPose> track = TrackOf(log, body);
  if (track.empty()) return std::nullopt;
  WalkFigures figures;
  // Whole cycles from where the commands begin to repeat.
  const std::optional<Period> period = FindGait(log);
  const int64_t start_us = period ? period->first_us : 0;
  if (period && period->period_us > 0) {
    figures.cycle_s = static_cast<double>(period->period_us) * 1e-6;
    for (int64_t t = start_us; t + period->period_us <= track.back().time_us;
         t += period->period_us) {
      const TrackedPose& begin = PoseAt(track, t);
      const TrackedPose& end = PoseAt(track, t + period->period_us);
      figures.cycle_north_m.push_back(end.p.x() - begin.p.x());
      figures.cycle_turn_rad.push_back(TurnBetween(begin, end));
    }
  }
  // Turn and tilt are against the start, however the frame lies in the body.
  const Eigen::Quaterniond q_0 = track.front().q;
  figures.turn_rad = TurnBetween(track.front(), track.back());
  figures.min_height_m = PoseAt(track, start_us).p.y();
  for (const TrackedPose& sample : track) {
    figures.max_tilt_rad = std::max(figures.max_tilt_rad, TiltBetween(q_0, sample.q));
    if (sample.time_us >= start_us)
      figures.min_height_m = std::min(figures.min_height_m, sample.p.y());
  }
  return figures;
}

}  // namespace morphbus::logger
