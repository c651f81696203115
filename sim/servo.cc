#include "sim/servo.h"

#include <algorithm>
#include <cmath>

namespace morphbus::sim {
namespace {

// A turning joint that is held fast lets its set-point run ahead by this much at most (rad or m),
// so that it does not turn on for minutes once it is free.
constexpr double kLongestLead = 0.25;

// A joint slower than its limit is asked for up to this many times what it lacks: the engine's
// motors give way under load in proportion to the velocity they are asked for.
constexpr double kPush = 10.0;

}  // namespace

ServoCommand ToServo(const morphbus::joint_command_t& command, double start, double sign) {
  // Anything but a target or a speed leaves the joint where it is.
  ServoCommand servo;
  if (command.mode == morphbus::joint_command_t::MODE_POSITION) {
    servo = {ServoMode::kPosition, sign * (command.target_si - start), command.speed_si};
  } else if (command.mode == morphbus::joint_command_t::MODE_VELOCITY) {
    servo = {ServoMode::kVelocity, 0.0, sign * command.speed_si};
  }
  return servo;
}

void Servo::Command(const ServoCommand& command) {
  // A command that makes no sense leaves the joint holding its place.
  command_ = ServoCommand{};
  if (command.mode == ServoMode::kHold) return;
  if (command.mode == ServoMode::kLimp) {
    command_.mode = ServoMode::kLimp;
    return;
  }
  if (!std::isfinite(command.target) || !std::isfinite(command.speed)) return;
  command_.mode = command.mode;
  if (command.mode == ServoMode::kPosition) {
    command_.target = std::clamp(command.target, limits_.lower, limits_.upper);
    command_.speed = std::min(std::abs(command.speed), limits_.speed);
  } else {
    command_.speed = std::clamp(command.speed, -limits_.speed, limits_.speed);
  }
}

double Servo::Step(double position, double rate, double dt) {
  // The set-point: towards the target at limited speed, or on and on at the commanded one, but
  // never far ahead of a joint that cannot follow.
  if (command_.mode == ServoMode::kPosition) {
    const double most = command_.speed * dt;
    set_point_ += std::clamp(command_.target - set_point_, -most, most);
  } else if (command_.mode == ServoMode::kVelocity) {
    set_point_ += command_.speed * dt;
    set_point_ = std::clamp(set_point_, position - kLongestLead, position + kLongestLead);
    set_point_ = std::clamp(set_point_, limits_.lower, limits_.upper);
  } else if (command_.mode == ServoMode::kLimp) {
    // It goes where the joint goes, from where it may once be held again.
    set_point_ = std::clamp(position, limits_.lower, limits_.upper);
  }
  // The velocity asked for is in proportion to the error and bounded: by the joint's speed when it
  // moves that fast, and by more the slower it is.
  const double slack = std::max(0.0, limits_.speed - std::abs(rate));
  const double most = limits_.speed + kPush * slack;
  return std::clamp(gain_per_s_ * (set_point_ - position), -most, most);
}

}  // namespace morphbus::sim
