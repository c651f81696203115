#pragma once
// A simulated robot that people act on while it runs, besides its modules.

#include <Eigen/Core>
#include <string>

#include "bridge/lockstep/simulated_robot.h"
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
};

}  // namespace morphbus::sim
