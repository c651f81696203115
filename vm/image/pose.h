#pragma once
// Poses in single precision, for a microcontroller: no Eigen, no heap.
// All frames are right-handed, and quaternions follow Hamilton's convention.

#include <cstdint>

namespace morphbus::vm {

/// A point (m), a direction or a displacement; a name's suffix says in which frame.
struct Vec3 {
  float x = 0, y = 0, z = 0;
};

/// Unit quaternion, w first.
struct Quat {
  float w = 1, x = 0, y = 0, z = 0;
};

/// The pose X_AB of frame B in frame A: p_A = q * p_B + p.
struct PoseF {
  /// The position of B's origin in A (m).
  Vec3 p;
  /// The rotation R_AB.
  Quat q;
};

/// Returns X_AC = X_AB * X_BC.
PoseF Compose(const PoseF& X_AB, const PoseF& X_BC);
/// Returns X_BA for X_AB.
PoseF Inverse(const PoseF& X_AB);
/// Returns v_A = R_AB * v_B; R_AB is a unit quaternion.
Vec3 Rotate(const Quat& R_AB, const Vec3& v_B);
/// The usual operations; both sides must be in one frame.
Vec3 Add(const Vec3& a, const Vec3& b);
Vec3 Subtract(const Vec3& a, const Vec3& b);
float Dot(const Vec3& a, const Vec3& b);
Vec3 Cross(const Vec3& a, const Vec3& b);
Vec3 Scale(float s, const Vec3& v);
float Norm(const Vec3& a);
/// Returns the mean of the positions of `count` poses in one frame; `count` is above 0.
Vec3 MeanOrigin(const PoseF* poses, int count);
/// Returns `q` scaled to unit length, or the identity if it is too small to scale.
Quat Normalize(const Quat& q);
/// Returns the motion of a revolute joint, Trans(o) * Rot(axis, q) * Trans(-o). `o` is a point on
/// the axis (m), `axis` a unit vector.
PoseF RevoluteMotion(const Vec3& o, const Vec3& axis, float q_rad);
/// Returns the motion of a prismatic joint, Trans(axis * q). `axis` is a unit vector.
PoseF PrismaticMotion(const Vec3& axis, float q_m);

}  // namespace morphbus::vm
