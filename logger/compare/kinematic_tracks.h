#pragma once
// Poses, angles and commands of a logged run in terms that two runs can be compared in.
//
// Frames: L link, R robot frame (moves with its root link), R0 the robot frame where it was in the
// world at the first logged tick, W world. Rest = the model's start values. Poses "as simulated"
// are given in R0, so that where a robot was put, and how high its lowest point stands, is no
// difference.

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bridge/description/link_places.h"
#include "compiler/model/robot_model.h"
#include "logger/log/run_log.h"
#include "vm/image/pose.h"

namespace morphbus::logger {

/// Values of one kind over sim time, in the unit or frame that their maker says.
template <class Value>
struct Track {
  /// Sim times in µs, ascending; there are as many values.
  std::vector<int64_t> time_us;
  std::vector<Value> value;
  /// Makes room for so many values: tracks are made by the hundred, and would grow step by step.
  void Reserve(size_t count) {
    time_us.reserve(count);
    value.reserve(count);
  }
  /// Appends one value; times must come in order.
  void Add(int64_t time, Value v) {
    time_us.push_back(time);
    value.push_back(std::move(v));
  }
};
/// Poses of a link or of the robot frame, in R or in R0 (m).
using PoseTrack = Track<model::Pose>;
using ScalarTrack = Track<double>;

/// What a joint is told in one tick, under its convention.
struct JointCommand {
  /// One of joint_command_t's modes: hold, position, velocity.
  int mode = 0;
  /// Target (rad, m) or velocity (rad/s, m/s), by mode; 0 for hold.
  double value = 0.0;
  /// Of a target (rad/s, m/s), without sign; 0 for the other modes.
  double speed_limit = 0.0;
};

/// The pose that a message holds (m); its quaternion w x y z may be off length 1 by rounding.
template <class PoseMessage>
model::Pose ToPose(const PoseMessage& message) {
  const auto* p = message.position_m;
  const auto* q = message.orientation_wxyz;
  model::Pose pose = model::Pose::Identity();
  pose.linear() = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().matrix();
  pose.translation() = Eigen::Vector3d(p[0], p[1], p[2]);
  return pose;
}

/// A pose in the VM's single precision, with w >= 0 and without negative zeros: equal poses are
/// equal bytes.
vm::PoseF ToVmPose(const model::Pose& X);

/// A stretch of sim time, from begin_us to end_us (µs), in which a module had one role and set of
/// labels.
struct RoleSpan {
  int64_t begin_us = 0;
  int64_t end_us = 0;
  /// The role's name; empty while it has none.
  std::string role;
  /// Label to joint index, in declaration order.
  std::map<std::string, int> joints;
  /// Label to link index, in declaration order.
  std::map<std::string, int> links;
};

/// What a module was, from its STATUS messages, in order of time until `end_us` (sim time, µs).
/// Empty if it never reported.
std::vector<RoleSpan> RoleSpans(const ModuleSeries& module, int64_t end_us);
/// When a role was taken first (sim time, µs); none if it never was.
std::optional<int64_t> FirstTaken(const std::vector<RoleSpan>& spans, const std::string& role);

/// By what a joint's values are multiplied over time, so that those of two runs can be compared: +1
/// or -1. Two modules of one role may be mounted so that the same motion has opposite signs.
class JointSigns {
 public:
  /// The joint's kinematic convention over time, as the module reports it (STATUS.joint_sign).
  JointSigns(const ModuleSeries& module, int joint);
  /// One sign (+1 or -1) at all times, for joints without a convention.
  explicit JointSigns(int sign) : signs_{{0, sign}} {}
  /// The sign at sim time `time_us` (µs): the last convention at or before it, else the first after
  /// it; 0 if there never is one.
  [[nodiscard]] int At(int64_t time_us) const;
  /// True if there ever is a convention.
  [[nodiscard]] bool ever() const { return !signs_.empty(); }
  /// Since when (sim time, µs) which sign holds, in order of time; the first holds before it, too.
  [[nodiscard]] const std::vector<std::pair<int64_t, int>>& spans() const { return signs_; }

 private:
  std::vector<std::pair<int64_t, int>> signs_;
};

/// Measured joint angles (rad) or travels (m), times their sign. `joint` is the joint's index in
/// declaration order; ticks without SENSORS are left out.
ScalarTrack AngleTrack(const ModuleSeries& module, int joint, const JointSigns& signs);
/// Their rates (rad/s or m/s), likewise.
ScalarTrack VelocityTrack(const ModuleSeries& module, int joint, const JointSigns& signs);
/// What their motors exert (N m or N), likewise.
ScalarTrack EffortTrack(const ModuleSeries& module, int joint, const JointSigns& signs);
/// Commands likewise: values times their sign, but a speed limit has no sign.
Track<JointCommand> CommandsOf(const ModuleSeries& module, int joint, const JointSigns& signs);
/// 1 where the module said that its poses age because the root is silent, else 0; only ticks at
/// which it had poses.
ScalarTrack StalenessTrack(const ModuleSeries& module);

/// X_RL(t) of the link with index `link`, as the module's VM propagated it (TRANSFORM); only ticks
/// at which it had one.
PoseTrack PropagatedTrack(const ModuleSeries& module, int link);

/// X_RL of every link at rest, by model index of the module, then link.
using RestPoses = std::vector<std::vector<model::Pose>>;

/// How far two links are from each other at one time.
struct PoseDifference {
  double metres = 0.0;   ///< Between the points of both links that at rest are A's origin.
  double radians = 0.0;  ///< Between R_A(t)·R_A(rest)ᵀ and R_B(t)·R_B(rest)ᵀ.
};

/// Compares the poses of two links over the times until `end_us` that both have. `rest_a` and
/// `rest_b` are their poses X_RL at rest. Both measures ignore that a module may be mounted the
/// other way round: its frame then lies and points elsewhere on the same piece of metal.
Track<PoseDifference> Differences(const PoseTrack& a, const PoseTrack& b, const model::Pose& rest_a,
                                  const model::Pose& rest_b, int64_t end_us);

/// Calls visit(i, j) for the times until `end_us` that both rows have: a[i] == b[j]. Both rows are
/// sim times in µs, ascending.
template <class Visit>
void ForCommonTimes(const std::vector<int64_t>& a, const std::vector<int64_t>& b, int64_t end_us,
                    const Visit& visit) {
  size_t i = 0;
  size_t j = 0;
  while (i < a.size() && j < b.size() && a[i] <= end_us && b[j] <= end_us) {
    if (a[i] == b[j]) {
      visit(i++, j++);
    } else {
      ++(a[i] < b[j] ? i : j);
    }
  }
}

/// A material point by which a link is found again when a module is mounted the other way round:
/// the mean of its hull's points, in M (m); M's origin for a link without points.
Eigen::Vector3d LinkCentre(const model::Link& link);

/// Poses of links in the simulated world. WORLD tells where bodies are, each by one of its links; a
/// body's other links follow from the dockings that SENSORS showed when the set of bodies last
/// changed.
class SimulatedPoses {
 public:
  /// `log` must have a model and outlive this. Builds the structure of all bodies, so it takes a
  /// while for a robot that often docks. `before`, if given, was made of the stretch of the run
  /// that came before the one that the log now holds.
  explicit SimulatedPoses(const RunLog& log, const SimulatedPoses* before = nullptr);
  /// True if WORLD is there from the first tick on and tells where the root body was then. Else
  /// there is no R0, and all tracks are empty.
  [[nodiscard]] bool available() const { return available_; }
  /// Pose of a link in the world (m) at RunLog::world[sample], also where there is no R0; none if
  /// no body carries the link.
  [[nodiscard]] std::optional<model::Pose> X_WL(size_t sample, int module, int link) const;
  /// X_WR0: where the robot frame was in the world at the first tick; the identity if not
  /// available().
  [[nodiscard]] model::Pose X_WR0() const { return X_R0W_.inverse(); }
  /// X_R0L(t), where some body carries the link. `module` is the module's index in the model,
  /// `link` the link's in declaration order.
  [[nodiscard]] PoseTrack LinkTrack(int module, int link) const {
    return TrackOf(module, link, model::Pose::Identity());
  }
  /// X_R0R(t): where the robot frame went, from where it was at the first tick.
  [[nodiscard]] PoseTrack RootTrack() const {
    return TrackOf(log_.robot->root_module, log_.robot->root_link, log_.robot->X_LR);
  }

 private:
  /// By model index of the module, then link.
  using Structure = std::vector<std::vector<bridge::PlacedLink<model::Pose>>>;
  /// Module id and link of each body, by which a set of bodies is told from another.
  using BodyKey = std::vector<std::pair<int, int>>;

  /// Finds the body that carries each link at the time of `sample`, and where in it.
  Structure BuildStructure(const WorldSample& sample) const;

  /// X_R0F(t) of a frame F that lies in a link as X_LF says.
  [[nodiscard]] PoseTrack TrackOf(int module, int link, const model::Pose& X_LF) const;

  const RunLog& log_;
  std::map<int, int> model_index_of_id_;
  /// The different structures that the bodies had, in order of time, and the bodies of the last
  /// one.
  std::vector<Structure> structures_;
  BodyKey last_bodies_;
  /// By index into log_.world: index into structures_.
  std::vector<int> structure_of_;
  /// Pose of the world in R0, by which world poses become poses in R0.
  model::Pose X_R0W_ = model::Pose::Identity();
  bool available_ = false;
};

}  // namespace morphbus::logger
