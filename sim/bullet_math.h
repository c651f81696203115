#pragma once
// Vectors, rotations and poses between Eigen and Bullet; both are in double precision, so nothing
// is lost.

#include <LinearMath/btTransform.h>

#include <Eigen/Core>

#include "compiler/model/robot_model.h"

namespace morphbus::sim {

/// A vector; what its numbers mean, points or directions, is the caller's.
inline btVector3 ToBullet(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
inline Eigen::Vector3d FromBullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

/// A rotation, row by row: Eigen keeps columns in memory, Bullet rows.
inline btMatrix3x3 ToBullet(const Eigen::Matrix3d& R) {
  return {R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)};
}
inline Eigen::Matrix3d FromBullet(const btMatrix3x3& R) {
  Eigen::Matrix3d out;
  for (int row = 0; row < 3; ++row) out.row(row) = FromBullet(R.getRow(row)).transpose();
  return out;
}

/// A pose; its linear part must be a rotation.
inline btTransform ToBullet(const model::Pose& X) {
  return btTransform(ToBullet(Eigen::Matrix3d(X.linear())),
                     ToBullet(Eigen::Vector3d(X.translation())));
}

}  // namespace morphbus::sim
