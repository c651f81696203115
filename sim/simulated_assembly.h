#pragma once
// A robot of the compiled model in a Bullet world, as the lockstep drives it: sensors out, commands
// in.

#include <map>
#include <memory>
#include <morphbus/actuator_t.hpp>
#include <morphbus/body_pose_t.hpp>
#include <morphbus/module_sensors_t.hpp>
#include <string>
#include <vector>

#include "bridge/simulated_robot.h"
#include "compiler/model/robot_model.h"
#include "compiler/source/result.h"
#include "sim/docking.h"
#include "sim/world.h"

namespace morphbus::sim {

struct AssemblyOptions {
  WorldOptions world;   ///< Its physics_step_s is set from physics_step_us.
  int tick_us = 20000;  ///< Control tick; a multiple of physics_step_us.
  int physics_step_us = 1000;
};

class SimulatedAssembly : public bridge::SimulatedRobot {
 public:
  /// Builds `robot` of `model` on the ground at its start values. Module ids are the indices into
  /// Robot::modules. Fails, in one sentence, if there is no such robot or an option makes no sense.
  static Result<std::unique_ptr<SimulatedAssembly>> Create(
      std::shared_ptr<const model::Model> model, const std::string& robot,
      const AssemblyOptions& options);

  void Sense(std::vector<morphbus::module_sensors_t>* out) override;

  /// One entry a body of the kinematic graph, by its first link (module, then link): X_WL of that
  /// link. Bodies that locked joints hold together have an entry each.
  void Truth(std::vector<morphbus::body_pose_t>* out) override;

  /// Commands are applied by the next Advance. Unknown modules and joints are ignored; a connector
  /// whose state no longer fits its connection comes apart, a free one that now fits a free
  /// connector next to it is joined with it.
  void Actuate(const morphbus::actuator_t& command) override;
  void Advance() override;

  /// Takes this connector off its mate. Fails if it has none.
  Result<void> Disconnect(const std::string& module, const std::string& connector);

  /// Joins this free connector to the free one it meets (kDockingDistance, kDockingAngle), setting
  /// the state variables of both as the connection needs. Fails if none is near enough.
  Result<void> Connect(const std::string& module, const std::string& connector);

  /// Pushes the body that holds this module's first link, for the next tick (N, W).
  Result<void> Push(const std::string& module, const Eigen::Vector3d& f_W);

  /// Hash of the world as first built: 16 hex digits, equal for congruent robots.
  [[nodiscard]] const std::string& world_hash() const { return world_hash_; }

  /// True poses of all links now.
  [[nodiscard]] LinkPoseTable LinkPoses() const;

  /// True joint values now, [module][joint].
  [[nodiscard]] model::JointValues Positions() const;

  [[nodiscard]] const World& world() const { return *world_; }
  [[nodiscard]] const model::Model& model() const { return *model_; }
  /// The robot with the connections it has now.
  [[nodiscard]] const model::Robot& robot() const { return robot_; }

 private:
  SimulatedAssembly(std::shared_ptr<const model::Model> model, const model::Robot& robot,
                    const AssemblyOptions& options);

  struct End {
    int module = 0;
    int connector = 0;
  };
  Result<End> FindEnd(const std::string& module, const std::string& connector) const;
  void ApplyConnectorCommands();
  void ApplyJointCommands();
  void Undock(size_t docking);
  void Dock(const model::Docking& docking);
  void Rebuild();
  void FindFirstLinks();

  std::shared_ptr<const model::Model> model_;
  model::Robot robot_;
  AssemblyOptions options_;
  std::unique_ptr<World> world_;
  std::string world_hash_;
  ConnectorStates states_;
  std::vector<LinkRef> first_links_;  ///< Of every body of the kinematic graph.
  std::vector<morphbus::actuator_t> pending_;
};

}  // namespace morphbus::sim
