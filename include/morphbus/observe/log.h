#pragma once
// Logs of runs: what was sensed, commanded and simulated, as series over sim time.
//
// Library morphbus-observe. A log is immutable and small: copies share what they refer to, and any
// number of threads may use it at once. Damage in a file never makes it unreadable: it is read past
// and counted. Units are SI; times are seconds of sim time since the run's start.

#include <morphbus/export.h>
#include <morphbus/failure.h>
#include <morphbus/model/model.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace morphbus {

/// What became of one joint, tick by tick. All vectors have one entry a tick of which the log has
/// the message; values are in rad, rad/s and N m, or in m, m/s and N where the joint slides.
struct JointSeries {
  /// "m1.joint_1".
  std::string joint;
  /// When it was measured (s), and the measurements.
  std::vector<double> time_s;
  std::vector<double> position;
  std::vector<double> velocity;
  /// What its motor exerted in the tick before.
  std::vector<double> effort;
  /// When it was commanded (s), and to which position; not a number in ticks without a target.
  std::vector<double> command_time_s;
  std::vector<double> target;
};

/// Where a link was over time.
struct PoseSeries {
  /// "m1.link_a".
  std::string link;
  std::vector<double> time_s;
  /// The pose of the link in the frame that the function names; as many as there are times.
  std::vector<Pose> pose;
};

/// A stretch of time in which a module played one role.
struct RolePlayed {
  double begin_s = 0;
  double end_s = 0;
  /// Empty while it had none.
  std::string role;
  /// The parts that the role's labels named: "knee" and "m1.joint_1" or "m1.link_a".
  std::vector<std::pair<std::string, std::string>> labels;
};

/// Which part of a file to read.
struct LogOptions {
  /// Which run, if the file holds several; empty: the first.
  std::string run = {};
};

/// A run as it was logged.
class MORPHBUS_EXPORT Log {
 public:
  /// Reads a log, compressed or not. Throws Failure if the file cannot be read at all, or holds no
  /// run of that name. Takes memory in proportion to the run.
  static Log Open(const std::string& path, const LogOptions& options = {});

  /// The run's name, and its hash: 32 hexadecimal digits that two runs have in common if the same
  /// messages were sent in both.
  [[nodiscard]] const std::string& run() const;
  [[nodiscard]] const std::string& hash() const;
  /// Sim time covered and length of a control tick (s); 0 where the log does not say.
  [[nodiscard]] double seconds() const;
  [[nodiscard]] double tick_s() const;
  /// True if nothing is missing or damaged, and the log vouches for that by its hash.
  [[nodiscard]] bool whole() const;
  /// All that `morphbus info --json` tells of it, as JSON (docs/log.md).
  [[nodiscard]] std::string InfoJson() const;

  /// The robot that ran. Throws Failure where the log does not say; series are there all the same.
  [[nodiscard]] Robot robot() const;
  /// The names of the modules that took part.
  [[nodiscard]] std::vector<std::string> ModuleNames() const;
  /// The roles that a module played, in order of time. Throws Failure for another name.
  [[nodiscard]] std::vector<RolePlayed> Roles(std::string_view module) const;

  /// A joint by its name, "m1.joint_1", in the sign of its actuator. Throws Failure, with the
  /// nearest name, where there is none.
  [[nodiscard]] JointSeries JointNamed(std::string_view name) const;
  /// Joints by what they are to the program, whatever module plays the part: of each module that
  /// ever played this role the joint that its label then named, in the ticks in which it did.
  /// Values are multiplied by the sign of the role's convention where there is one, so that those
  /// of two robots can be compared. Throws Failure, with what there is, where no module ever did.
  [[nodiscard]] std::vector<JointSeries> JointsLabelled(std::string_view role,
                                                        std::string_view label) const;
  /// Where a link was in the simulated world (its ground at y = 0; x north, y up, z east): X_WL.
  /// Throws Failure for another name, and has no times where the log has no world.
  [[nodiscard]] PoseSeries SimulatedPose(std::string_view link) const;
  /// Where the module of a link believed it to be, in the robot frame: X_RL. The same otherwise.
  [[nodiscard]] PoseSeries PropagatedPose(std::string_view link) const;

  /// For the other libraries of Morphbus: what is inside.
  class Content;
  explicit Log(std::shared_ptr<const Content> content);
  [[nodiscard]] const std::shared_ptr<const Content>& content() const { return content_; }

 private:
  std::shared_ptr<const Content> content_;
};

}  // namespace morphbus
