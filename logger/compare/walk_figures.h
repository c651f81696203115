#pragma once
// How a robot walked, from its log: found from what was commanded and what the world did, without
// knowing the program.

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <vector>

#include "logger/log/run_log.h"
#include "logger/log/tracked_body.h"

namespace morphbus::logger {

/// The figures of one walk. Headings and tilts are those of the tracked frame, measured against its
/// orientation in the first sample; W is the world (north, up, east).
struct WalkFigures {
  double cycle_s = 0.0;  ///< Period of the commands; 0 if they do not repeat.
  /// What the body moved north in each whole cycle, metres; the first cycle begins with the first
  /// command of the repeating part.
  std::vector<double> cycle_north_m;
  double turn_rad = 0.0;  ///< Heading gained, first to last tick; positive is to the west (left).
  std::vector<double> cycle_turn_rad;  ///< The same in each whole cycle.
  /// Largest angle between the body's up axis and where it was at first.
  double max_tilt_rad = 0.0;
  /// Lowest height of the point (y in W, m) from the first command of the repeating part on; if
  /// nothing repeats, from the first tick, standing up included.
  double min_height_m = 0.0;
};

/// Where the tracked frame P was at one time: p_WP (m) and the orientation R_WP.
struct TrackedPose {
  int64_t time_us = 0;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
};
/// The tracked frame over sim time; empty if the log has no poses of the body.
std::vector<TrackedPose> TrackOf(const RunLog& log, const TrackedBody& body);
/// The pose at `time_us` (µs), or the first after it; the last one if there is none. The track must
/// not be empty.
const TrackedPose& PoseAt(const std::vector<TrackedPose>& track, int64_t time_us);
/// Heading of `b` after `a` about up, rad; positive from north to west.
double TurnBetween(const TrackedPose& a, const TrackedPose& b);

/// Figures of a body. Empty if the log has no poses of it. Where the commands do not repeat, the
/// figures of cycles are empty and the others stand.
std::optional<WalkFigures> MeasureWalk(const RunLog& log, const TrackedBody& body);

/// Where the point went, from the first tick to the last (m, W). Empty if the log has no poses of
/// it.
std::optional<Eigen::Vector3d> MeasureDisplacement(const RunLog& log, const TrackedBody& body);

/// A change of one joint's target: when it came (sim time) and to what value (rad or m). The events
/// of a joint stand in order of time; a command that repeats the target is none.
struct CommandEvent {
  int64_t time_us = 0;
  double target = 0.0;
};

/// A part of the row that repeats to its end.
struct Period {
  /// Sim time from an event to its next repetition.
  int64_t period_us = 0;
  int64_t first_us = 0;  ///< Its first event.
};

/// The shortest repetition at the end of `events` that at least two whole periods bear out: the
/// same targets (1e-6) after the same times (within `slack_us`).
std::optional<Period> FindPeriod(const std::vector<CommandEvent>& events, int64_t slack_us);

/// The period with which the whole robot's commands repeat to the end of the run: that of the joint
/// that travels most among those whose period all joints keep. None if nothing repeats.
std::optional<Period> FindGait(const RunLog& log);
/// Sim times (µs) at which the cycles of this period began, the last one's end included: those of
/// the command that begins it, which in real time are not exactly a period apart.
std::vector<int64_t> CycleTimes(const RunLog& log, const Period& period);

}  // namespace morphbus::logger
