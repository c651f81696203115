#pragma once
// The position servo of one joint: a set-point that moves at limited speed, and the velocity that
// takes the joint to it.

#include <morphbus/joint_command_t.hpp>

namespace morphbus::sim {

/// What a servo does: hold its set-point, take it to a target, move it on for ever, or let the
/// joint go.
enum class ServoMode { kHold, kPosition, kVelocity, kLimp };

/// One command, which holds until the next.
struct ServoCommand {
  ServoMode mode = ServoMode::kHold;
  /// Where to go, rad or m; kPosition only.
  double target = 0.0;
  /// rad/s or m/s: the limit of the set-point's speed (kPosition), or its velocity (kVelocity).
  double speed = 0.0;
};

/// A command of a module, in its own joint values q, as one of the servo, in canonical angles
/// theta: q = start + sign * theta. A speed limit has no sign, a velocity has.
ServoCommand ToServo(const morphbus::joint_command_t& command, double start, double sign);

/// What the servo may do; lower <= 0 <= upper since it starts at 0.
struct ServoLimits {
  /// Limits of the set-point, rad or m; infinite for a joint that has none.
  double lower = 0.0;
  double upper = 0.0;
  /// The joint's own greatest speed, rad/s or m/s.
  double speed = 0.0;
};

/// Works in the joint's canonical angle (sim/rigid_body_model.h), so that mirrored commands give
/// mirrored results to the last bit. Torque is limited by the engine's motor, not here.
class Servo {
 public:
  /// A servo that holds 0. `gain_per_s` is the velocity it asks for per error (1/s).
  Servo(const ServoLimits& limits, double gain_per_s) : limits_(limits), gain_per_s_(gain_per_s) {}

  /// Takes effect from the next Step on. What is not finite holds the present set-point; targets
  /// are clamped to the limits, speeds to the joint's.
  void Command(const ServoCommand& command);

  /// Moves the set-point on by `dt` seconds and returns the velocity to ask the motor for (rad/s or
  /// m/s) at a joint that is at `position` and moves at `rate`: towards the set-point in proportion
  /// to the error. A joint that moves as fast as it may is asked for no more than its speed.
  double Step(double position, double rate, double dt);

  /// The motor exerts nothing: whatever velocity Step asks for, the joint is free.
  [[nodiscard]] bool limp() const { return command_.mode == ServoMode::kLimp; }
  /// Where the servo wants the joint now (rad or m); setting it is for a robot that goes on in a
  /// new world.
  [[nodiscard]] double set_point() const { return set_point_; }
  void set_set_point(double set_point) { set_point_ = set_point; }

 private:
  ServoLimits limits_;
  double gain_per_s_;
  double set_point_ = 0.0;
  ServoCommand command_;
};

}  // namespace morphbus::sim
