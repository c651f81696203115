#pragma once
// Poses of frames.

#include <array>

namespace morphbus {

/// The pose X_AB of a frame B in a frame A, named where it stands.
struct Pose {
  /// The origin of B in A: x, y, z (m).
  std::array<double, 3> position = {0, 0, 0};
  /// The rotation that takes coordinates in B to coordinates in A, as a unit quaternion w, x, y, z.
  /// Of the two that stand for it, the one with w >= 0.
  std::array<double, 4> rotation = {1, 0, 0, 0};

  bool operator==(const Pose&) const = default;

  /// The same as a matrix of 4 by 4 that takes homogeneous coordinates in B to A: row by row.
  [[nodiscard]] std::array<double, 16> Matrix() const {
    const auto& [w, x, y, z] = rotation;
    return {1 - 2 * (y * y + z * z),
            2 * (x * y - w * z),
            2 * (x * z + w * y),
            position[0],
            2 * (x * y + w * z),
            1 - 2 * (x * x + z * z),
            2 * (y * z - w * x),
            position[1],
            2 * (x * z - w * y),
            2 * (y * z + w * x),
            1 - 2 * (x * x + y * y),
            position[2],
            0,
            0,
            0,
            1};
  }
};

}  // namespace morphbus
