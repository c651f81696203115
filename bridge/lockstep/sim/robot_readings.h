#pragma once
// What the robot senses at a tick.

#include <functional>
#include <morphbus/body_pose_t.hpp>
#include <morphbus/contact_force_t.hpp>
#include <morphbus/module_sensors_t.hpp>
#include <morphbus/root_pose_t.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bridge/lockstep/sim/simulated_robot.h"

namespace morphbus::bridge {

/// The readings of all modules and the true state of the world at one moment: that of the tick that
/// is out.
class RobotReadings {
 public:
  /// Reads everything anew. `root` (may be empty) measures the pose of one module, which gets it
  /// with its own reading.
  void Sense(SimulatedRobot* robot, const std::function<morphbus::root_pose_t()>& root);
  /// Takes out what connects modules with those that are lost: a connector tells of a mate what the
  /// mate's own electronics say, and of a dead one nothing. `lost` is asked by id.
  void HideLost(const std::function<bool(int id)>& lost);
  /// Empty, or why no module could use these readings, as a sentence. `num_modules` is how many
  /// modules the run has.
  [[nodiscard]] std::string WhyUnusable(size_t num_modules) const;
  /// How many dockings the module furthest from this one (by place in the run) is away; modules
  /// that no row of dockings leads to do not count.
  [[nodiscard]] int HopsFrom(size_t module) const;

  /// By place in the run; empty before the first tick.
  [[nodiscard]] const std::vector<morphbus::module_sensors_t>& modules() const { return modules_; }
  [[nodiscard]] const std::vector<morphbus::body_pose_t>& bodies() const { return bodies_; }
  [[nodiscard]] const std::vector<morphbus::contact_force_t>& contacts() const { return contacts_; }
  /// What `root` measured; nothing without one.
  [[nodiscard]] const std::optional<morphbus::root_pose_t>& root_pose() const { return root_pose_; }

 private:
  std::vector<morphbus::module_sensors_t> modules_;
  std::vector<morphbus::body_pose_t> bodies_;
  std::vector<morphbus::contact_force_t> contacts_;
  std::optional<morphbus::root_pose_t> root_pose_;
};

}  // namespace morphbus::bridge
