#include "logger/compare/gait.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <numeric>

#include "compiler/base/text.h"

namespace morphbus::logger {
namespace {

/// The mean; 0 of nothing.
double MeanOf(const std::vector<double>& values) {
  if (values.empty()) return 0.0;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Whether the link's lowest point was on the ground at RunLog::world[sample]; none if no body
/// carries it, or it has no hull.
std::optional<bool> Stands(const RunLog& log, const SimulatedPoses& poses, const FootLink& foot,
                           size_t sample) {
  const ModuleSeries& module = log.modules[foot.module];
  const std::optional<model::Pose> X_WL = poses.X_WL(sample, module.model_index, foot.link);
  const auto& hull = log.model->TypeOf(*log.robot, module.model_index).links[foot.link].hull;
  if (!X_WL || hull.empty()) return std::nullopt;
  // The ground is at y = 0.
  double lowest = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& p_L : hull) lowest = std::min(lowest, (*X_WL * p_L).y());
  return lowest < kContactHeightM;
}

/// Where the trunk went in each cycle, and how high it was.
void MeasureTrunk(const RunLog& log, Gait* gait) {
  const std::vector<TrackedPose> track = TrackOf(log, Trunk(*log.model, *log.robot));
  if (track.empty()) return;
  gait->has_world = true;
  std::vector<double> forward, sideways, turn;
  for (size_t i = 0; i + 1 < gait->times_us.size(); ++i) {
    // Each cycle is measured from where and how the trunk stood at its beginning.
    const TrackedPose& begin = PoseAt(track, gait->times_us[i]);
    const TrackedPose& end = PoseAt(track, gait->times_us[i + 1]);
    // The heading is counted from the start, from north to west; x is north and z east.
    const double heading = TurnBetween(track.front(), begin);
    const Eigen::Vector3d moved = end.p - begin.p;
    forward.push_back(std::cos(heading) * moved.x() - std::sin(heading) * moved.z());
    sideways.push_back(-std::sin(heading) * moved.x() - std::cos(heading) * moved.z());
    turn.push_back(TurnBetween(begin, end));
  }
  gait->forward_m = MeanOf(forward);
  gait->sideways_m = MeanOf(sideways);
  gait->turn_rad = MeanOf(turn);
  // Standing up before and lying down after are no part of the gait.
  gait->height_m = std::numeric_limits<double>::infinity();
  for (const TrackedPose& pose : track) {
    if (pose.time_us < gait->times_us.front() || pose.time_us > gait->times_us.back()) continue;
    gait->height_m = std::min(gait->height_m, pose.p.y());
  }
}

/// The mean over all cycles of how far the joint's values lie apart in each.
double RangeOf(const RunLog& log, const GaitJoint& joint, const std::vector<int64_t>& times_us) {
  const ScalarTrack track = AngleTrack(log.modules[joint.module], joint.joint, JointSigns(1));
  std::vector<double> ranges;
  for (size_t i = 0; i + 1 < times_us.size(); ++i) {
    // The samples of one cycle.
    const auto at = [&](int64_t time_us) {
      const auto found = std::lower_bound(track.time_us.begin(), track.time_us.end(), time_us);
      return track.value.begin() + (found - track.time_us.begin());
    };
    const auto begin = at(times_us[i]);
    const auto end = at(times_us[i + 1]);
    if (begin == end) continue;
    const auto [least, most] = std::minmax_element(begin, end);
    ranges.push_back(*most - *least);
  }
  return MeanOf(ranges);
}

}  // namespace

std::optional<Gait> MeasureGait(const RunLog& log, const std::vector<FootLink>& feet,
                                const std::vector<GaitJoint>& joints) {
  // The commands say when cycles begin; without two of them there is no gait.
  const std::optional<Period> period = FindGait(log);
  if (!period || period->period_us <= 0) return std::nullopt;
  Gait gait;
  gait.times_us = CycleTimes(log, *period);
  if (gait.times_us.size() < 2) return std::nullopt;
  const auto cycles = static_cast<double>(gait.times_us.size() - 1);
  gait.cycle_s = Seconds(gait.times_us.back() - gait.times_us.front()) / cycles;
  MeasureTrunk(log, &gait);
  for (const GaitJoint& joint : joints) {
    gait.range.push_back(RangeOf(log, joint, gait.times_us));
  }
  // How long each foot stands, of the instants of all cycles.
  const SimulatedPoses poses(log);
  std::vector<int64_t> stood(feet.size()), seen(feet.size());
  for (size_t sample = 0; sample < log.world.size(); ++sample) {
    const int64_t time_us = log.world[sample].time_us;
    if (time_us < gait.times_us.front() || time_us >= gait.times_us.back()) continue;
    // An instant at which a foot is in no body counts neither way.
    for (size_t f = 0; f < feet.size(); ++f) {
      const std::optional<bool> stands = Stands(log, poses, feet[f], sample);
      seen[f] += stands ? 1 : 0;
      stood[f] += stands.value_or(false) ? 1 : 0;
    }
  }
  for (size_t f = 0; f < feet.size(); ++f) {
    gait.duty.push_back(
        seen[f] == 0 ? 0.0 : static_cast<double>(stood[f]) / static_cast<double>(seen[f]));
  }
  return gait;
}

std::vector<std::pair<const ModulePair*, const LinkPair*>> FootPairs(const Matching& matching) {
  // Labels are the program's choice, so "foot" is found in any case of letters. Every link may be
  // a candidate of three kinds; the most telling kind that there is, is chosen.
  std::vector<std::pair<const ModulePair*, const LinkPair*>> feet, labelled, roots;
  for (const ModulePair& pair : matching.pairs) {
    for (const LinkPair& link : pair.links) {
      std::string name = link.label;
      std::transform(name.begin(), name.end(), name.begin(),
                     [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
      if (name.find("foot") != std::string::npos) feet.emplace_back(&pair, &link);
      if (link.labelled) labelled.emplace_back(&pair, &link);
      if (link.label.empty()) roots.emplace_back(&pair, &link);
    }
  }
  return !feet.empty() ? feet : !labelled.empty() ? labelled : roots;
}

std::vector<FootLink> FeetOf(const Matching& matching, bool in_a) {
  std::vector<FootLink> feet;
  for (const auto& [pair, link] : FootPairs(matching)) {
    feet.push_back(
        {pair->role, link->label, in_a ? pair->a : pair->b, in_a ? link->link_a : link->link_b});
  }
  return feet;
}

std::vector<GaitJoint> JointsOf(const Matching& matching, bool in_a) {
  std::vector<GaitJoint> joints;
  for (const ModulePair& pair : matching.pairs) {
    for (const JointPair& joint : pair.joints) {
      joints.push_back({pair.role, joint.label, in_a ? pair.a : pair.b,
                        in_a ? joint.joint_a : joint.joint_b, joint.prismatic});
    }
  }
  return joints;
}

std::vector<std::pair<int64_t, int64_t>> Stances(const RunLog& log, const SimulatedPoses& poses,
                                                 const FootLink& foot) {
  std::vector<std::pair<int64_t, int64_t>> stances;
  bool stood = false;
  for (size_t sample = 0; sample < log.world.size(); ++sample) {
    const bool stands = Stands(log, poses, foot, sample).value_or(false);
    const int64_t time_us = log.world[sample].time_us;
    // A stance begins with the first sample on the ground and lasts to the last.
    if (stands && !stood) stances.emplace_back(time_us, time_us);
    if (stands) stances.back().second = time_us;
    stood = stands;
  }
  return stances;
}

}  // namespace morphbus::logger
