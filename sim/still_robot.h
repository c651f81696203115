#pragma once
// A robot without physics: its joints follow their set-points, and nothing has weight, touches
// anything or is anywhere. For benchmarks of the rest, and for programs that need no ground.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "compiler/model/forward_kinematics.h"
#include "sim/connections.h"
#include "sim/controlled_robot.h"
#include "sim/servo.h"

namespace morphbus::sim {

/// What `run --still` drives. Set-points move as those of a robot with physics do, step by step.
/// Connectors dock where the links are by forward kinematics; of each part that hangs together the
/// first module's first link stays where it was when the part came to be.
class StillRobot : public ControlledRobot {
 public:
  /// `robot` of `model` at its start values. The set-points move in steps of `physics_step_us`,
  /// of which `tick_us` is a multiple. Fails, in one sentence, if there is no such robot.
  static Result<std::unique_ptr<StillRobot>> Create(std::shared_ptr<const model::Model> model,
                                                    const std::string& robot, int tick_us,
                                                    int physics_step_us);

  /// Positions are the set-points, velocities what they moved by in the last tick.
  void Sense(std::vector<morphbus::module_sensors_t>* out) override;
  /// Nothing: there are no bodies.
  void Truth(std::vector<morphbus::body_pose_t>* out) override { out->clear(); }
  /// Connectors change at once, joints with the next Advance. Unknown modules, joints and
  /// connectors are ignored.
  void Actuate(const morphbus::actuator_t& command) override;
  /// Moves all set-points on by one tick.
  void Advance() override;

  // As in ControlledRobot; without physics nothing can be pushed.
  Result<void> Disconnect(const std::string& module, const std::string& connector) override;
  Result<void> Connect(const std::string& module, const std::string& connector,
                       const std::string& mate_module = "",
                       const std::string& mate_connector = "") override;
  Result<void> Push(const std::string& module, const Eigen::Vector3d& f_W, const std::string& link,
                    double seconds) override;
  [[nodiscard]] model::Pose LinkPose(int module, int link) const override {
    return ComputeLinkPoses()[module][link];
  }
  /// Without weights limp joints stay where they are, as those that hold do.
  void Lose(int module) override;

 private:
  /// A joint: its servo works relative to the start value.
  struct StillJoint {
    double start = 0;    ///< rad or m.
    bool fixed = false;  ///< A fixed joint reads 0 and takes no commands.
    Servo servo{{}, 0};
    double velocity = 0;  ///< rad/s or m/s, over the last tick.
  };

  StillRobot(std::shared_ptr<const model::Model> model, const model::Robot& robot, int tick_us,
             int physics_step_us);
  /// Where the links are now, X_RL. What comes apart or together moves no link.
  const LinkPoseTable& LinkPoses();
  /// Adds the readings of a module's sensors in a world without anything.
  void SenseNothing(int module, morphbus::module_sensors_t* out);
  /// The same computed anew, without being kept.
  [[nodiscard]] LinkPoseTable ComputeLinkPoses() const;
  /// Fills in the poses of modules that hang together, in ascending order.
  void AddPartPoses(const std::vector<int>& modules, LinkPoseTable* X_RL) const;

  std::shared_ptr<const model::Model> model_;
  /// The robot with the connections that it has now.
  Connections connections_;
  double step_s_;                                ///< Of the set-points, seconds.
  int steps_;                                    ///< A tick.
  std::vector<std::vector<StillJoint>> joints_;  ///< [module][joint].
  /// By module: X_RL of its first link when a connection last changed.
  std::vector<model::Pose> X_RL_anchor_;
  /// The poses of this tick, once they were needed; Advance makes anchors of them.
  std::optional<LinkPoseTable> X_RL_;
};

}  // namespace morphbus::sim
