#pragma once
// A pose in the numbers by which it is told to people and other programs.

#include <array>

#include "compiler/model/robot_model.h"

namespace morphbus::model {

/// Seven numbers that stand for a pose, the same for the same pose.
struct PoseNumbers {
  /// x, y, z (m), without negative zeros.
  std::array<double, 3> position = {};
  /// The rotation as a unit quaternion w, x, y, z: of the two that stand for it, the one with
  /// w >= 0; without negative zeros.
  std::array<double, 4> rotation = {};
};

/// The numbers of a pose.
PoseNumbers NumbersOf(const Pose& X);

}  // namespace morphbus::model
