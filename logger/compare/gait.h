#pragma once
// The figures of a gait: what one cycle takes, where it leads, and what feet and joints do in it.
// Two runs that are not the same in any one instant may still walk alike.

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "logger/compare/kinematic_tracks.h"
#include "logger/compare/matcher.h"
#include "logger/compare/walk_figures.h"
#include "logger/log/run_log.h"

namespace morphbus::logger {

/// A link whose foot falls count, by its place in the log.
struct FootLink {
  std::string role, label;
  /// Index into RunLog::modules, and the link's in its type.
  int module = 0;
  int link = 0;
};

/// A joint whose range counts, likewise.
struct GaitJoint {
  std::string role, label;
  int module = 0;
  int joint = 0;
  bool prismatic = false;
};

/// The figures of one run's gait; means over its whole cycles. W is the world (north, up, east).
struct Gait {
  /// Sim times (µs) at which the cycles begin, and the end of the last one.
  std::vector<int64_t> times_us;
  double cycle_s = 0.0;
  /// Whether the log holds the simulated world; without it only times, and ranges of joints, hold.
  bool has_world = false;
  /// What the trunk (walk_figures.h) moves in a cycle, in the direction in which it pointed when
  /// the cycle began, and to the left of that (m); and how far it turns to the left (rad).
  double forward_m = 0.0, sideways_m = 0.0, turn_rad = 0.0;
  /// The lowest height of the trunk's centre of mass in all cycles (y in W, m).
  double height_m = 0.0;
  /// For each foot the share of the time (0…1) for which it was on the ground: its lowest point
  /// below kContactHeightM.
  std::vector<double> duty;
  /// For each joint, its largest value less its smallest in a cycle (rad or m).
  std::vector<double> range;
};
/// A foot that is lower than this above the ground y = 0 stands on it, m.
inline constexpr double kContactHeightM = 0.005;

/// Measures the gait of a log with a model. None if its commands do not repeat for two cycles.
std::optional<Gait> MeasureGait(const RunLog& log, const std::vector<FootLink>& feet,
                                const std::vector<GaitJoint>& joints);

/// Pairs of links whose label speaks of a foot; else all labelled pairs; else the modules' root
/// links.
std::vector<std::pair<const ModulePair*, const LinkPair*>> FootPairs(const Matching& matching);
/// The feet of one of the two logs that were matched, in the order of FootPairs.
std::vector<FootLink> FeetOf(const Matching& matching, bool in_a);
/// The joints of one of them: those of all pairs, in their order.
std::vector<GaitJoint> JointsOf(const Matching& matching, bool in_a);

/// Sim times (µs) at which the link's lowest point comes down to the ground or leaves it, as
/// stretches [begin, end] for which it stands there.
std::vector<std::pair<int64_t, int64_t>> Stances(const RunLog& log, const SimulatedPoses& poses,
                                                 const FootLink& foot);

}  // namespace morphbus::logger
