#pragma once
// A simple model of a joint's servo: it goes towards its target as fast as it is told, at once.

#include "vm/module_api.h"

namespace morphbus::test {

struct Servo {
  /// Moves on by so many seconds, and says where it is then (rad) and how fast it has been (rad/s).
  void Move(double seconds, double* q, double* speed) {
    const double reach = command.speed * seconds, way = command.target - position;
    const double before = position;
    if (command.mode == vm::ActuatorMode::kVelocity) position += reach;
    if (command.mode == vm::ActuatorMode::kPosition) {
      position += way > reach ? reach : way < -reach ? -reach : way;
    }
    *q = position;
    *speed = (position - before) / seconds;
    if (position < lowest) lowest = position;
    if (position > highest) highest = position;
  }

  vm::JointCommand command;
  double position = 0;
  double lowest = 0, highest = 0;  ///< How far it ever went.
};

}  // namespace morphbus::test
