#pragma once
// The figures of a run: where the robot went, its gait, and what a cycle of it brings. This is the
// one place that computes them, and the one that writes them as text and as JSON; `run`, `report`
// and `compare` print what stands here, so that all agree to the last digit.
//
// A figure that is to be had of every run (energy, cost of transport, …) is a field of RunFigures,
// computed in FiguresOf() from what MotionOf() gathered, a key in FiguresJson() and a line
// in FigureLines().

#include <Eigen/Geometry>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "logger/figures/energy.h"
#include "logger/figures/robot_motion.h"

namespace morphbus::logger {

struct RunLog;

/// One whole cycle of a gait.
struct GaitCycle {
  int64_t begin_us = 0;
  int64_t end_us = 0;
  /// What the robot's centre of mass moved (m): north, up, east.
  Eigen::Vector3d advance = Eigen::Vector3d::Zero();
  /// The same in the direction in which the trunk pointed when the cycle began, and to the left of
  /// that.
  double forward_m = 0.0, left_m = 0.0;
  /// By how much the trunk turned to the left about up (rad).
  double turn_rad = 0.0;
  /// What the motors turned over (J, energy.h).
  double energy_j = 0.0;
};

/// The share of the time (0…1) for which a link touched the ground.
struct LinkDuty {
  int module = 0;
  int link = 0;
  std::string name;  ///< "m1.passive_block".
  double duty = 0.0;
};

/// How far a joint moves in a cycle: its largest value less its smallest (rad or m).
struct JointRange {
  int module = 0;
  int joint = 0;
  double range = 0.0;
};

/// A gait; means are over its whole cycles.
struct Gait {
  /// When the cycles begin (sim time, µs), and the end of the last one.
  std::vector<int64_t> times_us;
  double cycle_s = 0.0;
  /// Empty for a run without WORLD, of which only times and ranges are known.
  std::vector<GaitCycle> cycles;
  double forward_m = 0.0, left_m = 0.0, turn_rad = 0.0, energy_j = 0.0;
  /// Of all whole cycles together; see Transport.
  Transport transport;
  /// The lowest height of the trunk's centre of mass in all cycles (m).
  double height_m = 0.0;
  /// Of every link that touches the ground in them, by module and link.
  std::vector<LinkDuty> duties;
  /// Of every joint that may move, by module and joint.
  std::vector<JointRange> ranges;

  [[nodiscard]] int num_cycles() const { return static_cast<int>(times_us.size()) - 1; }
  /// The duty of a link; 0 if it never touches the ground.
  [[nodiscard]] double DutyOf(int module, int link) const;
  /// The range of a joint; 0 if it has none.
  [[nodiscard]] double RangeOf(int module, int joint) const;
};

/// How hard the motor of a joint worked (N m or N): the root of the mean square of its effort,
/// which heats it, and the largest magnitude.
struct JointLoad {
  std::string name;  ///< "m1.joint_1".
  double rms = 0.0, peak = 0.0;
};

/// See the head of this file. Figures of places are there if `has_world`.
struct RunFigures {
  bool has_world = false;
  /// Where the robot's centre of mass came, from the first tick to the last (m: north, up, east);
  /// the same of the robot frame, which the root's body carries.
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();
  Eigen::Vector3d root_displacement = Eigen::Vector3d::Zero();
  /// The length of the centre of mass's path, tick by tick (m).
  double path_length_m = 0.0;
  /// By how much the trunk turned to the left about up from first to last tick (rad), and by how
  /// much its up axis was tilted at most.
  double turn_rad = 0.0;
  double max_tilt_rad = 0.0;
  /// The lowest height of the trunk's centre of mass from the first cycle on; without a gait from
  /// the first tick on, getting up included (m).
  double min_height_m = 0.0;
  /// What the motors turned over (J), and what it brought (energy.h). Only of runs with WORLD: in
  /// one without physics nothing has a weight.
  double energy_j = 0.0;
  Transport transport;
  /// Of all joints that may move, by module and joint; those of links are in `motion.loads`.
  std::vector<JointLoad> joint_loads;
  /// The gait, or why there is none ("the commands do not change").
  std::optional<Gait> gait;
  std::string why_no_gait;
  /// What they were computed from, for plots.
  RobotMotion motion;
};

/// Computes those of a log with a model and series; of one without, there are none and the reason
/// says so.
RunFigures FiguresOf(const RunLog& log);

/// The pose of the trunk and the robot's centre of mass at a sim time (µs), between two samples on
/// the straight way from one to the other. The track must not be empty.
RobotSample SampleAt(const std::vector<RobotSample>& track, int64_t time_us);
/// By how much the trunk turned about up from `a` to `b`, rad, positive to the left (from north to
/// west): the twist about up of the rotation, so that what it does about other axes, such as to
/// roll over, is left out.
double TurnBetween(const RobotSample& a, const RobotSample& b);

/// The keys of figures in `run --json`, `compare --json` and `report` (docs/cli.md, "Figures"):
/// `displacement`, `root_displacement`, `path_length`, `energy`, `cost_of_transport`, `no_cost`,
/// `loads`, `walk`, `gait`, `no_gait`.
nlohmann::json FiguresJson(const RunFigures& figures);
/// One of them: the gait, null without one.
nlohmann::json GaitJson(const std::optional<Gait>& gait);
/// The same for people: names and values, in the order in which they are shown.
std::vector<std::pair<std::string, std::string>> FigureLines(const RunFigures& figures);

}  // namespace morphbus::logger
