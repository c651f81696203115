#pragma once
// What the simulator's side of the lockstep drives: implemented by sim/ (Bullet), by tests' fakes,
// and one day by hardware.

#include <morphbus/actuator_t.hpp>
#include <morphbus/body_pose_t.hpp>
#include <morphbus/contact_force_t.hpp>
#include <morphbus/module_sensors_t.hpp>
#include <string>
#include <vector>

namespace morphbus::bridge {

/// A robot as the lockstep drives it, one control tick after another: SimParticipant calls
/// Sense, Truth and ContactForces, then Actuate for every module that answered, then Advance.
class SimulatedRobot {
 public:
  virtual ~SimulatedRobot() = default;

  /// Sensors of all modules now, in order of module_id. Replaces the content of `out`.
  virtual void Sense(std::vector<morphbus::module_sensors_t>* out) = 0;

  /// True pose of every body now (may be empty). Replaces the content of `out`.
  virtual void Truth(std::vector<morphbus::body_pose_t>* out) = 0;

  /// What the ground and obstacles exerted on links during the last tick (contact_force_t), in
  /// order of module_id and link. Replaces the content of `out`; nothing for a robot without
  /// physics.
  virtual void ContactForces(std::vector<morphbus::contact_force_t>* out) { out->clear(); }

  /// Takes one module's commands for the coming tick. Called once a module and tick, in order of
  /// module_id, whatever the order of arrival.
  virtual void Actuate(const morphbus::actuator_t& command) = 0;

  /// Advances by one control tick.
  virtual void Advance() = 0;

  /// Why what the robot does is not to be believed any more, in one sentence with what to change;
  /// empty while all is well. Asked after each Advance: the run then ends with it as its error.
  [[nodiscard]] virtual std::string Breakdown() const { return {}; }
};

}  // namespace morphbus::bridge
