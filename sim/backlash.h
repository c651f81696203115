#pragma once
// Joints with play between motor and link: a motor that pushes its link from one side only, and
// where it is itself.

#include <btBulletDynamicsCommon.h>

namespace morphbus::sim {

/// A hinge whose motor may be told to push one way only. Bullet's motors push and pull, as one
/// without play does.
class OneWayHinge : public btHingeConstraint {
 public:
  using btHingeConstraint::btHingeConstraint;
  /// In the coming step the motor pushes body A towards positive (+1) or negative (-1) angles.
  void set_push(double sign) { push_ = sign; }
  /// Asked by Bullet for the rows of a step.
  void getInfo2(btConstraintInfo2* info) override;

 private:
  double push_ = 1.0;
};

/// A slider likewise; its motor pushes body B towards positive or negative places.
class OneWaySlider : public btSliderConstraint {
 public:
  using btSliderConstraint::btSliderConstraint;
  void set_push(double sign) { push_ = sign; }
  void getInfo2(btConstraintInfo2* info) override;

 private:
  double push_ = 1.0;
};

/// The motor's side of a joint with play, in the joint's canonical angle (rad or m). It has no
/// inertia of its own: in the play it moves as its servo asks, and at an edge of the play as the
/// link lets it.
class MotorSide {
 public:
  /// `play` is how far the link can move while the motor stands, `speed` the motor's greatest.
  MotorSide(double play, double speed) : half_(0.5 * play), speed_(speed) {}

  [[nodiscard]] bool has_play() const { return half_ > 0.0; }
  /// Where it is, and how fast it went in the last step.
  [[nodiscard]] double position() const { return position_; }
  [[nodiscard]] double rate() const { return rate_; }
  /// Sets where it is, for a robot that goes on in a new world.
  void set_position(double position) { position_ = position; }

  /// What a motor is asked for in a step: the least velocity of the link, or the greatest, and
  /// which way it pushes to see to it.
  struct Push {
    double velocity = 0.0;
    double sign = 1.0;
  };
  /// Of a link at `theta` that moves at `theta_rate`, while the servo asks for `velocity`, in a
  /// step of `dt` seconds: the edge of the play that the link is nearer to takes it along.
  [[nodiscard]] Push PushOf(double theta, double theta_rate, double velocity, double dt) const;
  /// After the step: it is where the servo asked it to go, as far as the link, now at `theta`, let
  /// it.
  void Follow(double theta, double velocity, double dt);

 private:
  double half_;
  double speed_;
  double position_ = 0.0;
  double rate_ = 0.0;
};

}  // namespace morphbus::sim
