#pragma once
// A simulated robot that people act on while it runs, besides its modules.

#include <Eigen/Geometry>
#include <string>

#include "bridge/lockstep/sim/simulated_robot.h"
#include "compiler/base/result.h"

namespace morphbus::sim {

/// What `morphbus control` and `run --commands` do to a robot. All of it happens between two ticks.
class ControlledRobot : public bridge::SimulatedRobot {
 public:
  /// Takes this connector off its mate. Fails, in one sentence, if it has none.
  virtual Result<void> Disconnect(const std::string& module, const std::string& connector) = 0;

  /// Joins this free connector to the free one it meets (kDockingDistance, kDockingAngle), setting
  /// the state variables of both as the connection needs. Fails if none is near enough, or if it is
  /// another one than that of `mate_module`, where this is given.
  virtual Result<void> Connect(const std::string& module, const std::string& connector,
                               const std::string& mate_module,
                               const std::string& mate_connector) = 0;

  /// Pushes the body that holds this link of a module (empty: its first one) at its centre of mass,
  /// from the next tick on (N, W), for so many seconds of sim time; 0: for one tick. Fails if there
  /// is no such link, or no physics.
  virtual Result<void> Push(const std::string& module, const Eigen::Vector3d& f_W,
                            const std::string& link, double seconds) = 0;

  /// True pose X_WL of a link now, both by number; without physics, X_RL as the joints have it.
  [[nodiscard]] virtual Eigen::Isometry3d LinkPose(int module, int link) const = 0;
  /// This module (by index) is dead from now on: its joints go limp or hold, as its type's
  /// `on_loss` says, and nothing commands them any more. Its connectors stay as they are.
  virtual void Lose(int module) = 0;
};

}  // namespace morphbus::sim
