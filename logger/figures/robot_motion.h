#pragma once
// How a robot moved, tick by tick: what the figures of a run are computed from.
//
// Frames: W world (north, up, east; ground at y = 0), R robot frame, L link, P a point's frame.

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "compiler/model/kinematic_graph.h"
#include "compiler/model/robot_model.h"

namespace morphbus::logger {

struct RunLog;

/// Where the robot was at the start of one tick (m, in W).
struct RobotSample {
  int64_t time_us = 0;
  /// The centre of mass of all links together.
  Eigen::Vector3d p_WCm = Eigen::Vector3d::Zero();
  /// The robot frame, as the root's body carries it.
  Eigen::Vector3d p_WR = Eigen::Vector3d::Zero();
  /// The trunk (tracked_body.h): its centre of mass, and how it is turned.
  Eigen::Vector3d p_WT = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_WT = Eigen::Quaterniond::Identity();
};

/// One joint, a value a tick; not a number where nothing was heard.
struct JointSeries {
  /// By index in the robot, and in the module's type.
  int module = 0;
  int joint = 0;
  model::JointType type = model::JointType::kRevolute;
  /// "m1.joint_1".
  std::string name = {};
  /// The last target that it was given (rad or m), in the actuator's sign; and the velocity at
  /// which it is told to turn on (rad/s or m/s), 0 while it has a target or holds.
  std::vector<double> target = {}, velocity = {};
  /// Where it was (rad or m), and what its motor exerted in the tick before (N m or N), by its
  /// sensors.
  std::vector<double> position = {}, effort = {};
};

/// What the ground and obstacles exerted on a link, over all ticks of which WORLD is known.
struct LinkLoad {
  int module = 0;
  int link = 0;
  /// "m1.passive_block".
  std::string name;
  /// The mean force (N, in W), and the largest magnitude of a tick's (N).
  Eigen::Vector3d mean_W = Eigen::Vector3d::Zero();
  double peak_n = 0.0;
};

/// A link that touched the ground, and when.
struct GroundContact {
  int module = 0;
  int link = 0;
  /// "m1.passive_block".
  std::string name;
  /// Stretches of RobotMotion::track in which it stood: first index, and the one behind the last.
  std::vector<std::pair<int, int>> stances;
};
/// A link whose lowest point is lower than this above the ground y = 0 touches it, m.
inline constexpr double kContactHeightM = 0.005;

/// A whole run.
struct RobotMotion {
  /// Length of a tick, µs of sim time; and whether it was a run in real time, in which commands may
  /// come late.
  int32_t tick_us = 0;
  bool realtime = false;
  /// In order of time; ticks at which it is not known of every link where it was are left out.
  /// Empty for a run without WORLD.
  std::vector<RobotSample> track;
  /// All joints that may move, by module and joint; index 0 of their rows is this sim time (µs).
  int64_t first_us = 0;
  std::vector<JointSeries> joints;
  /// By module and link.
  std::vector<GroundContact> contacts;
  /// By module and link; those of links that nothing pushed are left out.
  std::vector<LinkLoad> loads;
  /// What all links weigh together.
  double mass_kg = 0.0;
};

/// How the robot of a log moved. The log must have a model, a length of tick and series. What names
/// modules or links that the robot does not have is passed over.
RobotMotion MotionOf(const RunLog& log);

}  // namespace morphbus::logger
