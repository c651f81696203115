#pragma once
// What is said to joints.

namespace morphbus {

/// What a joint shall do until the next tick, in the sign of its actuator.
struct JointCommand {
  /// It keeps its set-point, drives to a target, or turns at a speed.
  enum class Mode { kHold, kPosition, kVelocity };
  Mode mode = Mode::kHold;
  /// Where it drives to (rad, or m where it slides); of kPosition.
  double target = 0;
  /// Its speed at most, of kPosition; its velocity, of kVelocity (rad/s or m/s).
  double speed = 0;

  bool operator==(const JointCommand&) const = default;
};

}  // namespace morphbus
