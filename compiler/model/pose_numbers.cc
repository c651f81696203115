#include "compiler/model/pose_numbers.h"

namespace morphbus::model {
namespace {

/// Rounds nothing, but gives 0 for -0.
double WithoutNegativeZero(double v) { return v == 0.0 ? 0.0 : v; }

}  // namespace

PoseNumbers NumbersOf(const Pose& X) {
  // q and -q are one rotation: the one with w >= 0 stands for both, so that numbers can be
  // compared.
  Eigen::Quaterniond q(X.linear());
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  PoseNumbers numbers;
  for (int i = 0; i < 3; ++i) numbers.position[i] = WithoutNegativeZero(X.translation()[i]);
  numbers.rotation = {WithoutNegativeZero(q.w()), WithoutNegativeZero(q.x()),
                      WithoutNegativeZero(q.y()), WithoutNegativeZero(q.z())};
  return numbers;
}

}  // namespace morphbus::model
