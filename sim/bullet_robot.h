#pragma once
// A robot of the compiled model in a Bullet world, as the lockstep drives it: sensors out, commands
// in.

#include <cstdint>
#include <map>
#include <memory>
#include <morphbus/actuator_t.hpp>
#include <morphbus/body_pose_t.hpp>
#include <morphbus/module_sensors_t.hpp>
#include <set>
#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "compiler/model/robot_model.h"
#include "sim/connections.h"
#include "sim/controlled_robot.h"
#include "sim/delayed_commands.h"
#include "sim/start_check.h"
#include "sim/world.h"

namespace morphbus::sim {

/// How a robot is simulated. A run is repeated bit for bit only with the
/// same options.
struct BulletRobotOptions {
  /// The world's own options; its physics_step_s is set from physics_step_us.
  WorldOptions world;
  /// Sim time between two readings of the sensors, microseconds; a multiple of physics_step_us.
  int tick_us = 20000;
  /// Sim time of one step of the engine, microseconds.
  int physics_step_us = 1000;
  /// Of the noise of sensors, and of what links weigh that weigh more or less by chance.
  uint64_t noise_seed = 1;
};

/// The robot that the simulator's process drives. Values on this interface are the modules' own
/// (joint values of the model, raw actuator signs); canonical angles stay inside.
class BulletRobot : public ControlledRobot {
 public:
  /// Builds `robot` of `model` on the ground at its start values. Module ids are the indices into
  /// Robot::modules. Fails, in one sentence, if there is no such robot or an option makes no sense.
  static Result<std::unique_ptr<BulletRobot>> Create(std::shared_ptr<const model::Model> model,
                                                     const std::string& robot,
                                                     const BulletRobotOptions& options);

  /// What every module senses now, in order of module id: joint positions, velocities and efforts,
  /// what its sensors measure, and what is docked to its connectors.
  void Sense(std::vector<morphbus::module_sensors_t>* out) override;

  /// One entry a body of the kinematic graph, by its first link (module, then link): X_WL of that
  /// link. Bodies that locked joints hold together have an entry each.
  void Truth(std::vector<morphbus::body_pose_t>* out) override;

  /// As in SimulatedRobot.
  void ContactForces(std::vector<morphbus::contact_force_t>* out) override { *out = contacts_; }

  /// Commands are applied by the next Advance. Unknown modules and joints are ignored; a connector
  /// whose state no longer fits its connection comes apart, a free one that now fits a free
  /// connector next to it is joined with it.
  void Actuate(const morphbus::actuator_t& command) override;

  /// Applies the commands, then runs the physics for one tick.
  void Advance() override;

  // As in ControlledRobot.
  Result<void> Disconnect(const std::string& module, const std::string& connector) override;
  Result<void> Connect(const std::string& module, const std::string& connector,
                       const std::string& mate_module = "",
                       const std::string& mate_connector = "") override;
  Result<void> Push(const std::string& module, const Eigen::Vector3d& f_W,
                    const std::string& link = "", double seconds = 0) override;
  [[nodiscard]] Pose LinkPose(int module, int link) const override {
    return LinkPoses()[module][link];
  }
  void Lose(int module) override {
    lost_.insert(module);
    delayed_.Forget(module);
  }
  /// A joint that stands far beyond its limits, or a body that is nowhere (sim/breakdown.h).
  [[nodiscard]] std::string Breakdown() const override { return breakdown_; }

  /// Whether it can start where it is (sim/start_check.h). For a robot that is only tried: it
  /// cannot be run afterwards.
  Result<void> CheckStart() { return sim::CheckStart(world_.get(), *model_, robot()); }

  /// Hash of the world as first built: 16 hex digits, equal for congruent robots.
  [[nodiscard]] const std::string& world_hash() const { return world_hash_; }

  /// True poses of all links now.
  [[nodiscard]] LinkPoseTable LinkPoses() const;

  /// True joint values now, [module][joint]: those of the links, where joints have play.
  [[nodiscard]] model::JointValues Positions() const;

  /// How often the world was made anew because connections had changed: at most once a tick by
  /// commands of modules.
  [[nodiscard]] int64_t rebuilds() const { return rebuilds_; }

  /// The world now. Connecting and disconnecting replace it.
  [[nodiscard]] const World& world() const { return *world_; }
  /// The model that the robot was built from.
  [[nodiscard]] const model::Model& model() const { return *model_; }
  /// The robot with the connections it has now.
  [[nodiscard]] const model::Robot& robot() const { return connections_.robot(); }

 private:
  BulletRobot(std::shared_ptr<const model::Model> model, const model::Robot& robot,
              const BulletRobotOptions& options);

  /// A push that goes on: by link, since bodies change when connectors open and close.
  struct LastingPush {
    LinkRef link;
    Eigen::Vector3d f_W;
    int64_t steps = 0;  ///< Physics steps that are left.
  };

  // The two halves of applying what Actuate has gathered, and what Push has.
  void ApplyConnectorCommands();
  void ApplyJointCommands();
  /// Hands a command to a joint's servo; the module must have that joint, and it must move.
  void CommandJoint(int module, int joint, const morphbus::joint_command_t& command);
  void ApplyPushes();
  /// Runs the physics for one tick, and measures what was exerted in it: means over its steps.
  void StepPhysics();

  /// Makes the world anew after a change of the structure.
  void Rebuild();
  void FindFirstLinks();

  std::shared_ptr<const model::Model> model_;
  Connections connections_;
  /// Of the links of its module types, which stay what they are when the structure changes.
  LinkPhysicsTable physics_;
  /// What each link weighs of that.
  model::MassFactors mass_factors_;
  BulletRobotOptions options_;
  /// The engine with the robot in it; made anew when the structure changes.
  std::unique_ptr<World> world_;
  int64_t rebuilds_ = 0;
  /// That of the first world; it stays when the structure changes.
  std::string world_hash_;
  /// The first link of every body of the kinematic graph, by which Truth names the body.
  std::vector<LinkRef> first_links_;
  /// What Actuate has gathered since the last Advance.
  std::vector<morphbus::actuator_t> pending_;
  /// What has not come to its servo yet.
  DelayedCommands delayed_;
  std::vector<LastingPush> pushes_;
  /// What the motors exerted in the last tick, [module][joint], in the module's own signs (N m, N);
  /// and what the world did. Both are kept by module, since a change of the structure makes new
  /// bodies and joints.
  std::vector<std::vector<float>> effort_;
  std::vector<morphbus::contact_force_t> contacts_;
  /// How many ticks have been computed.
  int64_t tick_ = 0;
  /// Modules that are dead.
  std::set<int> lost_;
  std::string breakdown_;
};

}  // namespace morphbus::sim
