#include "compiler/elementary/arc_tangent.h"

#include <array>
#include <cmath>

#include "compiler/elementary/double_double.h"
#include "compiler/elementary/exact.h"

namespace morphbus::elementary {
namespace {

constexpr int kSteps = 128;
constexpr DoubleDouble kPi = {0x1.921fb54442d18p+1, 0x1.1a62633145c07p-53};
constexpr DoubleDouble kHalfPi = {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54};

/// atan(k / 128) for k of 0 to 128, each from the one before: atan(v) - atan(u) = atan((v - u) / (1
/// + u v)), which is small.
constexpr std::array<DoubleDouble, kSteps + 1> ArcTangentsOfSteps() {
  std::array<DoubleDouble, kSteps + 1> arcs{};
  for (int k = 0; k < kSteps; ++k) {
    const DoubleDouble t = DoubleDouble{kSteps, 0} /
                           DoubleDouble{static_cast<double>(kSteps * kSteps + k * (k + 1)), 0};
    const DoubleDouble square = t * t;
    DoubleDouble power = t, arc = t;
    for (int n = 3; n < 18; n += 2) {
      power = -(power * square);
      arc = arc + power / DoubleDouble{static_cast<double>(n), 0};
    }
    arcs[k + 1] = arcs[k] + arc;
  }
  return arcs;
}
constexpr std::array<DoubleDouble, kSteps + 1> kArcs = ArcTangentsOfSteps();

/// The arc tangent of n / d, where 0 <= n <= d and both are 0 or between 2^-300 and 2^300; right to
/// 2^-67 of itself.
DoubleDouble ArcOfQuotient(const DoubleDouble& n, const DoubleDouble& d) {
  // The nearest k / 128, from which the rest is t = (n - c d) / (d + c n), below 2^-8.
  const int k = static_cast<int>(n.hi / d.hi * kSteps + 0.5);
  const double c = k * (1.0 / kSteps);
  const DoubleDouble t =
      k == 0 ? n / d : (n - DoubleDouble{c, 0} * d) / (d + DoubleDouble{c, 0} * n);
  // The terms beyond t are below 2^-17.5 of it, and computed with four roundings.
  const double tt = t.hi * t.hi;
  const double beyond = t.hi * tt * (-1.0 / 3 + tt * (1.0 / 5 + tt * (-1.0 / 7 + tt * (1.0 / 9))));
  const DoubleDouble sum = Sum(kArcs[k].hi, t.hi);
  return FastSum(sum.hi, sum.lo + (beyond + (t.lo + kArcs[k].lo)));
}

/// Whether ArcOfQuotient takes the larger and the smaller of two numbers that are not negative.
bool IsTaken(double larger, double smaller) {
  return larger <= 0x1p300 && larger >= 0x1p-300 && (smaller >= 0x1p-300 || smaller == 0);
}

/// The angle of (x, y), both not negative and of those taken, in the first quarter.
DoubleDouble FirstQuarter(const DoubleDouble& y, const DoubleDouble& x) {
  return y.hi <= x.hi ? ArcOfQuotient(y, x) : kHalfPi - ArcOfQuotient(x, y);
}

constexpr double kError = 0x1p-65;

/// sqrt(1 - x^2) for |x| < 1.
DoubleDouble OtherLeg(double x) {
  const DoubleDouble square = Product(x, x);
  const DoubleDouble rest = DoubleDouble{1, 0} - square;
  // Newton's step from the root in doubles.
  const double root = std::sqrt(rest.hi);
  const DoubleDouble back = Product(root, root);
  return FastSum(root, ((rest.hi - back.hi) - back.lo + rest.lo) / (2 * root));
}

}  // namespace

double ArcTangent(double y, double x) {
  // No angle at all, most often a joint at rest.
  if (y == 0 && x > 0) return y;
  const double height = std::fabs(y), width = std::fabs(x);
  if (height < width ? IsTaken(width, height) : IsTaken(height, width)) {
    const DoubleDouble acute = FirstQuarter({height, 0}, {width, 0});
    const DoubleDouble angle = std::signbit(x) ? kPi - acute : acute;
    double nearest = 0;
    if (RoundsTo(angle, angle.hi * kError, &nearest)) return std::copysign(nearest, y);
  }
  return Exactly(mpfr_atan2, y, x);
}

double ArcSine(double x) {
  const double size = std::fabs(x);
  // x + x^3/6 rounds to x.
  if (size < 0x1p-26) return x;
  if (size < 1) {
    const DoubleDouble angle = FirstQuarter({size, 0}, OtherLeg(x));
    double nearest = 0;
    if (RoundsTo(angle, angle.hi * kError, &nearest)) return std::copysign(nearest, x);
  }
  return Exactly(mpfr_asin, x);
}

double ArcCosine(double x) {
  const double size = std::fabs(x);
  if (x == 1) return 0;
  if (size < 1 && (size >= 0x1p-60 || size == 0)) {
    const DoubleDouble acute = FirstQuarter(OtherLeg(x), {size, 0});
    const DoubleDouble angle = x < 0 ? kPi - acute : acute;
    double nearest = 0;
    if (RoundsTo(angle, angle.hi * kError, &nearest)) return nearest;
  }
  return Exactly(mpfr_acos, x);
}

}  // namespace morphbus::elementary
