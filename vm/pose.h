#pragma once
// Poses in single precision, for a microcontroller: no Eigen, no heap.

#include <cstdint>

namespace morphbus::vm {

struct Vec3 {
  float x = 0, y = 0, z = 0;
};

/// Unit quaternion, w first.
struct Quat {
  float w = 1, x = 0, y = 0, z = 0;
};

/// Pose X_AB of frame B in frame A (m).
struct PoseF {
  Vec3 p;
  Quat q;
};

/// X_AC = X_AB * X_BC.
PoseF Compose(const PoseF& X_AB, const PoseF& X_BC);
/// X_BA from X_AB.
PoseF Inverse(const PoseF& X_AB);
/// v_A = R_AB * v_B.
Vec3 Rotate(const Quat& R_AB, const Vec3& v_B);
Vec3 Add(const Vec3& a, const Vec3& b);
Vec3 Subtract(const Vec3& a, const Vec3& b);
float Dot(const Vec3& a, const Vec3& b);
float Norm(const Vec3& a);
/// Scales to unit length; the identity for a quaternion too small to scale.
Quat Normalize(const Quat& q);
/// Trans(o) * Rot(axis, q) * Trans(-o): a revolute joint's motion (axis is a unit vector).
PoseF RevoluteMotion(const Vec3& o, const Vec3& axis, float q_rad);
/// Trans(axis * q): a prismatic joint's motion.
PoseF PrismaticMotion(const Vec3& axis, float q_m);

}  // namespace morphbus::vm
