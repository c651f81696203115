#include "vm/image/pose.h"

#include "vm/image/sine.h"
#include "vm/image/square_root.h"

namespace morphbus::vm {

namespace {

/// Hamilton's product: first b, then a.
Quat Multiply(const Quat& a, const Quat& b) {
  return {
      a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
      a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

/// The inverse of a unit quaternion.
Quat Conjugate(const Quat& q) { return {q.w, -q.x, -q.y, -q.z}; }

}  // namespace

Vec3 Cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

Vec3 Scale(float s, const Vec3& v) { return {s * v.x, s * v.y, s * v.z}; }

Vec3 Add(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }

Vec3 Subtract(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }

float Dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

float Norm(const Vec3& a) { return SquareRoot(Dot(a, a)); }

Vec3 MeanOrigin(const PoseF* poses, int count) {
  Vec3 sum;
  for (int i = 0; i < count; ++i) sum = Add(sum, poses[i].p);
  const auto n = static_cast<float>(count);
  return {sum.x / n, sum.y / n, sum.z / n};
}

Quat Normalize(const Quat& q) {
  // Rounding leaves a quaternion a little off its unit length.
  const float norm = SquareRoot(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  // Also taken where the norm is not a number.
  if (!(norm > 1e-6f)) return {};
  const float s = 1.0f / norm;
  return {s * q.w, s * q.x, s * q.y, s * q.z};
}

Vec3 Rotate(const Quat& R_AB, const Vec3& v_B) {
  // v + 2w(u x v) + 2u x (u x v), u the vector part: fewer products than the matrix.
  const Vec3 u{R_AB.x, R_AB.y, R_AB.z};
  const Vec3 t = Scale(2.0f, Cross(u, v_B));
  return Add(v_B, Add(Scale(R_AB.w, t), Cross(u, t)));
}

PoseF Compose(const PoseF& X_AB, const PoseF& X_BC) {
  // Normalised each time, so that rounding does not add up over a long chain of modules.
  return {Add(X_AB.p, Rotate(X_AB.q, X_BC.p)), Normalize(Multiply(X_AB.q, X_BC.q))};
}

PoseF Inverse(const PoseF& X_AB) {
  const Quat R_BA = Conjugate(X_AB.q);
  return {Scale(-1.0f, Rotate(R_BA, X_AB.p)), R_BA};
}

PoseF RevoluteMotion(const Vec3& o, const Vec3& axis, float q_rad) {
  // The quaternion of a turn has half its angle; o stays where it is.
  const auto [s, c] = SineCosineOf(0.5f * q_rad);
  const Quat R{c, s * axis.x, s * axis.y, s * axis.z};
  return {Subtract(o, Rotate(R, o)), R};
}

PoseF PrismaticMotion(const Vec3& axis, float q_m) { return {Scale(q_m, axis), {}}; }

}  // namespace morphbus::vm
