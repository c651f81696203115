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

#include "compiler/model/robot_model.h"
#include "logger/run_log.h"

namespace morphbus::logger {

/// A pose over sim time.
struct PoseTrack {
  std::vector<int64_t> time_us;
  std::vector<Eigen::Vector3d> p;     ///< Metres.
  std::vector<Eigen::Quaterniond> q;  ///< Unit.
  void Add(int64_t time, const Eigen::Vector3d& position, const Eigen::Quaterniond& rotation);
};

/// A number over sim time.
struct ScalarTrack {
  std::vector<int64_t> time_us;
  std::vector<double> value;
};

/// A joint's commands over sim time, under its convention.
struct CommandTrack {
  std::vector<int64_t> time_us;
  std::vector<int> mode;      ///< joint_command_t.mode.
  std::vector<double> value;  ///< Target (rad, m) or velocity (rad/s, m/s); 0 for hold.
};

/// A stretch of time in which a module had one role and set of labels.
struct RoleSpan {
  int64_t begin_us = 0;
  int64_t end_us = 0;
  std::string role;                   ///< Empty: none.
  std::map<std::string, int> joints;  ///< Label to joint index.
  std::map<std::string, int> links;   ///< Label to link index.
};

/// What a module was, from its STATUS messages, until `end_us`. Empty if it never reported.
std::vector<RoleSpan> RoleSpans(const ModuleSeries& module, int64_t end_us);

/// Signs of a joint's kinematic convention over time (STATUS.joint_sign).
class SignTimeline {
 public:
  SignTimeline(const ModuleSeries& module, int joint);
  /// The last convention at or before `time_us`, else the first after it; 0 if there never is one.
  [[nodiscard]] int At(int64_t time_us) const;
  [[nodiscard]] bool ever() const { return !signs_.empty(); }

 private:
  std::vector<std::pair<int64_t, int>> signs_;
};

/// Measured joint values times `sign(t)`; a constant sign if `signs` is null.
ScalarTrack AngleTrack(const ModuleSeries& module, int joint, const SignTimeline* signs, int sign);
/// Commands likewise.
CommandTrack CommandsOf(const ModuleSeries& module, int joint, const SignTimeline* signs, int sign);

/// X_RL(t) as the module's VM propagated it (TRANSFORM), where it had one.
PoseTrack PropagatedTrack(const ModuleSeries& module, int link);

/// X_RL of every link at rest, by model index of the module, then link.
using RestPoses = std::vector<std::vector<model::Pose>>;
RestPoses RestPosesOf(const RunLog& log);

/// How far two links are from each other over the times that both tracks have, until `end_us`.
struct PoseDifferences {
  std::vector<int64_t> time_us;
  std::vector<double> metres;   ///< Between the points of both links that at rest are A's origin.
  std::vector<double> radians;  ///< Between R_A(t)·R_A(rest)ᵀ and R_B(t)·R_B(rest)ᵀ.
  int64_t missing = 0;          ///< Times that only one track has.
};

/// Both measures ignore that a module may be mounted the other way round: its frame then lies and
/// points elsewhere on the same piece of metal.
PoseDifferences Differences(const PoseTrack& a, const PoseTrack& b, const model::Pose& rest_a,
                            const model::Pose& rest_b, int64_t end_us);

/// Calls visit(i, j) for times that both rows (sorted) have until `end_us`; returns how many only
/// one of them has.
template <class Visit>
int64_t ForCommonTimes(const std::vector<int64_t>& a, const std::vector<int64_t>& b, int64_t end_us,
                       const Visit& visit) {
  int64_t alone = 0;
  size_t i = 0;
  size_t j = 0;
  while (true) {
    const bool more_a = i < a.size() && a[i] <= end_us;
    const bool more_b = j < b.size() && b[j] <= end_us;
    if (!more_a && !more_b) return alone;
    if (more_a && more_b && a[i] == b[j]) {
      visit(i++, j++);
    } else {
      ++alone;
      if (more_a && (!more_b || a[i] < b[j])) {
        ++i;
      } else {
        ++j;
      }
    }
  }
}

/// A material point by which a link is found again when a module is mounted the other way round:
/// the mean of its hull's points, in M (m); M's origin for a link without points.
Eigen::Vector3d LinkCentre(const model::Link& link);

/// Poses of links in the simulated world. WORLD tells where bodies are; a body's other links follow
/// from the dockings that SENSORS showed when the set of bodies last changed.
class SimulatedPoses {
 public:
  /// `log` must have a model and outlive this.
  explicit SimulatedPoses(const RunLog& log);
  /// False if WORLD or the root body's pose at the start is missing: then all tracks are empty.
  [[nodiscard]] bool available() const { return available_; }
  /// X_R0L(t). `module` is the module's index in the model.
  [[nodiscard]] PoseTrack LinkTrack(int module, int link) const;
  /// X_R0R(t): the root body, that is where the robot frame went.
  [[nodiscard]] PoseTrack RootTrack() const;

 private:
  /// Where a link is: in which entry of WorldSample::bodies, and where in that body.
  struct Place {
    int body = -1;
    model::Pose X_BL = model::Pose::Identity();
  };
  using Structure = std::vector<std::vector<Place>>;  ///< By model index of the module, then link.

  Structure BuildStructure(const WorldSample& sample) const;
  [[nodiscard]] std::optional<model::Pose> X_WL(size_t sample, int module, int link) const;

  const RunLog& log_;
  std::vector<int> model_index_of_id_;  ///< -1 where unknown.
  std::vector<Structure> structures_;
  std::vector<int> structure_of_;  ///< By world sample.
  model::Pose X_R0W_ = model::Pose::Identity();
  bool available_ = false;
};

}  // namespace morphbus::logger
