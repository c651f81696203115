#include "sim/backlash.h"

#include <algorithm>
#include <cstddef>

namespace morphbus::sim {
namespace {

// The rows of Bullet's constraints at which those of the motors stand: behind the five of a hinge,
// and the four of a slider.
constexpr int kHingeMotorRow = 5;
constexpr int kSliderMotorRow = 4;

// Leaves of what a motor may exert in a row, -max to max, one half. A row at a mechanical stop is
// the stop's, whose bounds are not alike, and stays.
void KeepHalf(btTypedConstraint::btConstraintInfo2* info, int row, bool positive) {
  btScalar& lower = info->m_lowerLimit[static_cast<ptrdiff_t>(row) * info->rowskip];
  btScalar& upper = info->m_upperLimit[static_cast<ptrdiff_t>(row) * info->rowskip];
  if (lower != -upper) return;
  (positive ? lower : upper) = 0.0;
}

}  // namespace

void OneWayHinge::getInfo2(btConstraintInfo2* info) {
  btHingeConstraint::getInfo2(info);
  KeepHalf(info, kHingeMotorRow, push_ > 0.0);
}

// The row's impulse acts on body A, against the sense of the place of B.
void OneWaySlider::getInfo2(btConstraintInfo2* info) {
  btSliderConstraint::getInfo2(info);
  KeepHalf(info, kSliderMotorRow, push_ < 0.0);
}

MotorSide::Push MotorSide::PushOf(double theta, double theta_rate, double velocity,
                                  double dt) const {
  const double goal = position_ + velocity * dt;
  const double sign = theta + theta_rate * dt < goal ? 1.0 : -1.0;
  // Behind this the link must not fall, or beyond it run, in the step.
  const double edge = goal - sign * half_;
  return {(edge - theta) / dt, sign};
}

void MotorSide::Follow(double theta, double velocity, double dt) {
  const double before = position_;
  // Without a load nothing keeps the motor from more than its speed but itself.
  position_ += std::clamp(velocity, -speed_, speed_) * dt;
  position_ = std::clamp(position_, theta - half_, theta + half_);
  rate_ = (position_ - before) / dt;
}

}  // namespace morphbus::sim
