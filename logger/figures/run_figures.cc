#include "logger/figures/run_figures.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "compiler/base/text.h"
#include "logger/figures/gait_cycle.h"
#include "logger/log/run_log.h"

namespace morphbus::logger {
namespace {

/// Angles that are closer are one (1 degree): programs round to whole degrees. Of prismatic joints
/// 1 mm.
constexpr double kAngleTolerance = 1.0 * EIGEN_PI / 180.0;
constexpr double kTravelTolerance = 1e-3;
/// By how many ticks a command may be early or late; in real time, where a tick does not wait for
/// late messages, by so much time.
constexpr int kSlackTicks = 2;
constexpr int64_t kRealtimeSlackUs = 150'000;
/// Joints that repeat follow the commands if their mismatch (gait_cycle.h) is below this: they lag
/// behind and are pushed about, but have little in common with themselves at a wrong time.
constexpr double kMostMotionMismatch = 0.25;

/// The mean of one figure of all cycles.
template <class Figure>
double MeanOf(const std::vector<GaitCycle>& cycles, const Figure& figure) {
  double sum = 0.0;
  for (const GaitCycle& cycle : cycles) sum += figure(cycle);
  return cycles.empty() ? 0.0 : sum / static_cast<double>(cycles.size());
}

double ToleranceOf(const JointSeries& joint) {
  return joint.type == model::JointType::kPrismatic ? kTravelTolerance : kAngleTolerance;
}

/// Appends positions as a signal. A joint that turns without limits is where it was after a whole
/// turn.
void AddPositions(const JointSeries& joint, const std::vector<double>& row,
                  std::vector<Signal>* signals) {
  if (row.empty() || std::isnan(row.front())) return;
  if (joint.type != model::JointType::kContinuous) {
    signals->push_back({row, ToleranceOf(joint)});
    return;
  }
  // Cosine and sine together are an angle without its whole turns; near 0 their differences are
  // radians, so that the tolerance stays the same.
  Signal cosine{row, kAngleTolerance}, sine{row, kAngleTolerance};
  for (double& x : cosine.values) x = std::cos(x);
  for (double& x : sine.values) x = std::sin(x);
  signals->push_back(std::move(cosine));
  signals->push_back(std::move(sine));
}

/// What all joints are told.
std::vector<Signal> Commands(const RobotMotion& motion) {
  std::vector<Signal> signals;
  for (const JointSeries& joint : motion.joints) {
    // Target and velocity are two signals, of which at most one changes while a joint has one mode.
    AddPositions(joint, joint.target, &signals);
    if (!joint.velocity.empty() && !std::isnan(joint.velocity.front())) {
      signals.push_back({joint.velocity, ToleranceOf(joint)});
    }
  }
  return signals;
}

/// Where all joints are.
std::vector<Signal> Positions(const RobotMotion& motion) {
  std::vector<Signal> signals;
  for (const JointSeries& joint : motion.joints) AddPositions(joint, joint.position, &signals);
  return signals;
}

/// The cycle by the commands, if the joints bear it out.
CycleSearch FindGait(const RobotMotion& motion) {
  CycleOptions options;
  options.tick_s = Seconds(motion.tick_us);
  options.slack_ticks = kSlackTicks;
  if (motion.realtime && motion.tick_us > 0) {
    options.slack_ticks = std::max<int>(kSlackTicks, kRealtimeSlackUs / motion.tick_us);
  }
  CycleSearch search = FindCycle(Commands(motion), options);
  const std::vector<Signal> positions = Positions(motion);
  // Without sensors there are the commands alone.
  if (!search.cycle || positions.empty()) return search;
  const FoundCycle& cycle = *search.cycle;
  // What joints are told need not happen: they may stall, or be pushed elsewhere. A gait is in
  // both.
  const std::optional<double> mismatch =
      Mismatch(positions, cycle.period, static_cast<int>(cycle.begins.front()),
               static_cast<int>(cycle.begins.back()), options.slack_ticks);
  const std::string told = "the commands repeat every " +
                           std::to_string(std::lround(cycle.period * options.tick_s * 1e3)) + " ms";
  if (!mismatch) return {{}, told + ", but no joint moves"};
  if (*mismatch > kMostMotionMismatch) return {{}, told + ", but the joints do not"};
  return search;
}

/// Where the robot was in each cycle, and how high.
void MeasureWay(const std::vector<RobotSample>& track, Gait* gait) {
  for (int i = 0; i < gait->num_cycles(); ++i) {
    GaitCycle cycle;
    cycle.begin_us = gait->times_us[i];
    cycle.end_us = gait->times_us[i + 1];
    // A cycle need not begin at a tick: both ends are taken from between two samples.
    const RobotSample begin = SampleAt(track, cycle.begin_us);
    const RobotSample end = SampleAt(track, cycle.end_us);
    cycle.advance = end.p_WCm - begin.p_WCm;
    cycle.turn_rad = TurnBetween(begin, end);
    // The heading is counted from the start, from north to west; x is north and z east.
    const double heading = TurnBetween(track.front(), begin);
    cycle.forward_m = std::cos(heading) * cycle.advance.x() - std::sin(heading) * cycle.advance.z();
    cycle.left_m = -std::sin(heading) * cycle.advance.x() - std::cos(heading) * cycle.advance.z();
    gait->cycles.push_back(cycle);
  }
  gait->forward_m = MeanOf(gait->cycles, [](const GaitCycle& c) { return c.forward_m; });
  gait->left_m = MeanOf(gait->cycles, [](const GaitCycle& c) { return c.left_m; });
  gait->turn_rad = MeanOf(gait->cycles, [](const GaitCycle& c) { return c.turn_rad; });
  // Standing up before and lying down after are no part of the gait.
  gait->height_m = std::numeric_limits<double>::infinity();
  for (const RobotSample& sample : track) {
    if (sample.time_us < gait->times_us.front() || sample.time_us > gait->times_us.back()) continue;
    gait->height_m = std::min(gait->height_m, sample.p_WT.y());
  }
}

/// What each cycle took, and what all of them brought.
void MeasureEffort(const RobotMotion& motion, const EnergyMeter& energy, Gait* gait) {
  for (GaitCycle& cycle : gait->cycles) {
    cycle.energy_j = energy.Between(cycle.begin_us, cycle.end_us);
  }
  gait->energy_j = MeanOf(gait->cycles, [](const GaitCycle& c) { return c.energy_j; });
  const int64_t begin_us = gait->times_us.front(), end_us = gait->times_us.back();
  // Of all cycles together and not as a mean: the way of a single cycle may be next to nothing.
  gait->transport = MeasureTransport(motion, energy.Between(begin_us, end_us), begin_us, end_us);
}

/// How hard each motor worked, over the whole run.
std::vector<JointLoad> JointLoadsOf(const RobotMotion& motion) {
  std::vector<JointLoad> loads;
  for (const JointSeries& joint : motion.joints) {
    JointLoad& load = loads.emplace_back(JointLoad{joint.name, 0.0, 0.0});
    for (const double effort : joint.effort) {
      if (std::isnan(effort)) continue;
      load.rms += effort * effort;
      load.peak = std::max(load.peak, std::abs(effort));
    }
    if (!joint.effort.empty()) {
      load.rms = std::sqrt(load.rms / static_cast<double>(joint.effort.size()));
    }
  }
  return loads;
}

/// How long each link stands, of the instants of all cycles.
void MeasureDuties(const RobotMotion& motion, Gait* gait) {
  // Stances are told in indices of the track, and so are the cycles here: from the first sample of
  // the first one up to and without the first behind the last.
  const auto index = [&](int64_t time_us) {
    const auto found = std::ranges::lower_bound(motion.track, time_us, {}, &RobotSample::time_us);
    return static_cast<int>(found - motion.track.begin());
  };
  const int begin = index(gait->times_us.front()), end = index(gait->times_us.back());
  for (const GroundContact& contact : motion.contacts) {
    int stood = 0;
    for (const auto& [from, to] : contact.stances) {
      stood += std::max(0, std::min(to, end) - std::max(from, begin));
    }
    if (stood == 0) continue;
    gait->duties.push_back({contact.module, contact.link, contact.name,
                            static_cast<double>(stood) / static_cast<double>(end - begin)});
  }
}

/// How far each joint moves, mean over the cycles.
void MeasureRanges(const RobotMotion& motion, Gait* gait) {
  for (const JointSeries& joint : motion.joints) {
    if (joint.position.empty() || std::isnan(joint.position.front())) continue;
    const auto at = [&](int64_t time_us) {
      // The first tick that is not before the time, and never behind the last.
      const int64_t slot = (time_us - motion.first_us + motion.tick_us - 1) / motion.tick_us;
      return joint.position.begin() + std::min(slot, static_cast<int64_t>(joint.position.size()));
    };
    double sum = 0.0;
    for (int i = 0; i < gait->num_cycles(); ++i) {
      const auto begin = at(gait->times_us[i]), end = at(gait->times_us[i + 1]);
      // A log that ends early, or has a hole, may know nothing of a cycle.
      if (begin == end) continue;
      const auto [least, most] = std::minmax_element(begin, end);
      sum += *most - *least;
    }
    gait->ranges.push_back({joint.module, joint.joint, sum / gait->num_cycles()});
  }
}

/// What the whole run did, by the track.
void MeasureRun(const std::vector<RobotSample>& track, int64_t gait_begin_us, RunFigures* figures) {
  figures->has_world = true;
  const RobotSample& first = track.front();
  figures->displacement = track.back().p_WCm - first.p_WCm;
  figures->root_displacement = track.back().p_WR - first.p_WR;
  figures->turn_rad = TurnBetween(first, track.back());
  figures->min_height_m = SampleAt(track, gait_begin_us).p_WT.y();
  const RobotSample* before = &first;
  for (const RobotSample& sample : track) {
    figures->path_length_m += (sample.p_WCm - before->p_WCm).norm();
    before = &sample;
    figures->max_tilt_rad = std::max(figures->max_tilt_rad, TiltBetween(first.q_WT, sample.q_WT));
    if (sample.time_us < gait_begin_us) continue;
    figures->min_height_m = std::min(figures->min_height_m, sample.p_WT.y());
  }
}

}  // namespace

double Gait::DutyOf(int module, int link) const {
  for (const LinkDuty& duty : duties) {
    if (duty.module == module && duty.link == link) return duty.duty;
  }
  return 0.0;
}

double Gait::RangeOf(int module, int joint) const {
  for (const JointRange& range : ranges) {
    if (range.module == module && range.joint == joint) return range.range;
  }
  return 0.0;
}

RobotSample SampleAt(const std::vector<RobotSample>& track, int64_t time_us) {
  const auto after = std::ranges::lower_bound(track, time_us, {}, &RobotSample::time_us);
  if (after == track.end()) return track.back();
  if (after == track.begin() || after->time_us == time_us) return *after;
  const RobotSample& a = *(after - 1);
  const RobotSample& b = *after;
  // The straight way between both places, and of the trunk the shortest rotation (slerp).
  const double part =
      static_cast<double>(time_us - a.time_us) / static_cast<double>(b.time_us - a.time_us);
  return {time_us, a.p_WCm + part * (b.p_WCm - a.p_WCm), a.p_WR + part * (b.p_WR - a.p_WR),
          a.p_WT + part * (b.p_WT - a.p_WT), a.q_WT.slerp(part, b.q_WT)};
}

double TurnBetween(const RobotSample& a, const RobotSample& b) {
  // The twist of a rotation about y is the part (w, y) of its quaternion, scaled to length 1
  // (swing-twist decomposition); its angle is brought to within half a turn of 0. Positive about y
  // is from north (x) to west (-z).
  const Eigen::Quaterniond turn = b.q_WT * a.q_WT.conjugate();
  return std::remainder(2.0 * std::atan2(turn.y(), turn.w()), 2.0 * EIGEN_PI);
}

RunFigures FiguresOf(const RunLog& log) {
  RunFigures figures;
  figures.why_no_gait = "the log does not say which robot it shows";
  if (log.model == nullptr || log.robot == nullptr) return figures;
  RobotMotion motion = MotionOf(log);
  const EnergyMeter energy(motion);
  CycleSearch search = FindGait(motion);
  figures.why_no_gait = search.why_not;
  if (search.cycle) {
    Gait& gait = figures.gait.emplace();
    // FindCycle counts in ticks from the signals' first one, and in parts of ticks.
    for (const double begin : search.cycle->begins) {
      gait.times_us.push_back(motion.first_us + std::llround(begin * motion.tick_us));
    }
    gait.cycle_s = Seconds(gait.times_us.back() - gait.times_us.front()) / gait.num_cycles();
    MeasureRanges(motion, &gait);
    if (!motion.track.empty()) {
      MeasureWay(motion.track, &gait);
      MeasureDuties(motion, &gait);
      MeasureEffort(motion, energy, &gait);
    }
  }
  // What follows needs places, and so a simulated world. Heights count from the gait on, since
  // getting up is low.
  if (!motion.track.empty()) {
    MeasureRun(motion.track,
               figures.gait ? figures.gait->times_us.front() : motion.track.front().time_us,
               &figures);
    figures.energy_j = energy.Total();
    figures.transport = MeasureTransport(motion, figures.energy_j, motion.track.front().time_us,
                                         motion.track.back().time_us);
    figures.joint_loads = JointLoadsOf(motion);
  }
  figures.motion = std::move(motion);
  return figures;
}

}  // namespace morphbus::logger
