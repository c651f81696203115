#include "compiler/elementary/sine.h"

#include <array>

#include "compiler/elementary/double_double.h"
#include "compiler/elementary/exact.h"

// An angle is k steps of pi/256 and a rest of at most half a step; sines of the steps come from a
// table, those of the rest from the first terms of their series. P. T. P. Tang, "Table-driven
// implementation of the exponential function in IEEE floating-point arithmetic", ACM Transactions
// on Mathematical Software 15 (1989), does so with other functions.

namespace morphbus::elementary {
namespace {

constexpr int kTurn = 512, kQuarter = kTurn / 4;  // steps

/// pi/256 in three parts. The first two have 33 bits each, so that up to 2^20 times each is exact.
constexpr double kStep1 = 0x1.921fb544p-7, kStep2 = 0x1.0b4611a6p-41,
                 kStep3 = 0x1.3198a2e037073p-76;
constexpr double kStepsPerRadian = 0x1.45f306dc9c883p+6;

/// x^first / first! - x^(first + 2) / (first + 2)! + … for first of 0 (cosine) or 1 (sine) and |x|
/// <= pi/4.
constexpr DoubleDouble Series(const DoubleDouble& x, int first) {
  const DoubleDouble square = x * x;
  DoubleDouble term = first == 0 ? DoubleDouble{1, 0} : x;
  DoubleDouble sum = term;
  for (int n = first + 2; n < 30; n += 2) {
    term = -(term * square / DoubleDouble{static_cast<double>(n * (n - 1)), 0});
    sum = sum + term;
  }
  return sum;
}

/// Sines of all steps of a turn, from those of its first eighth.
constexpr std::array<DoubleDouble, kTurn> SinesOfSteps() {
  std::array<DoubleDouble, kTurn> sines{};
  for (int k = 0; k <= kQuarter / 2; ++k) {
    const DoubleDouble angle =
        DoubleDouble{static_cast<double>(k), 0} * (Sum(kStep1, kStep2) + DoubleDouble{kStep3, 0});
    sines[k] = Series(angle, 1);
    sines[kQuarter - k] = Series(angle, 0);
  }
  for (int k = 1; k <= kQuarter; ++k) {
    sines[2 * kQuarter - k] = sines[k];
    sines[2 * kQuarter + k] = -sines[k];
    if (k < kQuarter) sines[4 * kQuarter - k] = -sines[k];
  }
  sines[kQuarter + kQuarter] = sines[0];
  return sines;
}
constexpr std::array<DoubleDouble, kTurn> kSines = SinesOfSteps();

constexpr double Magnitude(double x) { return x < 0 ? -x : x; }

/// The sine of an angle of |x| <= 1024 that is turned on by `quarters` of a turn. False if the
/// rounding test does not decide.
bool TableSine(double x, int quarters, double* nearest) {
  // Adding and taking away 1.5 * 2^52 rounds to a whole number.
  const double steps = (x * kStepsPerRadian + 0x1.8p52) - 0x1.8p52;
  const int k = static_cast<int>(steps) + quarters * kQuarter;
  // All is exact up to the last part, which is 2^-108 off at most.
  const DoubleDouble first = Sum(x, -steps * kStep1);
  const DoubleDouble second = Sum(first.hi, -steps * kStep2);
  const DoubleDouble rest = FastSum(second.hi, second.lo + (first.lo - steps * kStep3));

  // sin(a + r) = sin a + cos a * r + cos a * (sin r - r) + sin a * (cos r - 1), the last two in
  // plain doubles.
  const DoubleDouble& sine = kSines[k & (kTurn - 1)];
  const DoubleDouble& cosine = kSines[(k + kQuarter) & (kTurn - 1)];
  const double r = rest.hi, rr = r * r;
  const double sine_beyond = r * rr * (-1.0 / 6 + rr * (1.0 / 120 - rr * (1.0 / 5040)));
  const double cosine_beyond =
      rr * (-0.5 + rr * (1.0 / 24 + rr * (-1.0 / 720 + rr * (1.0 / 40320)))) - r * rest.lo;
  const DoubleDouble linear = Product(cosine.hi, r);
  const DoubleDouble sum = Sum(sine.hi, linear.hi);
  const double small = (cosine.hi * sine_beyond + sine.hi * cosine_beyond) +
                       (linear.lo + (cosine.hi * rest.lo + cosine.lo * r) + sine.lo);
  const DoubleDouble all = FastSum(sum.hi, sum.lo + small);
  // |r| < 2^-7.3: the plain terms are below 2^-15.6 |sin a| and 2^-24.5, and each is off by four
  // roundings at most; a sum is at least half of sin a. So it is right to 2^-65 of itself, or to
  // 2^-105 where it nearly vanishes.
  return RoundsTo(all, Magnitude(all.hi) * 0x1p-64 + 0x1p-100, nearest);
}

}  // namespace

double Sine(double x) {
  const double size = Magnitude(x);
  // x - x^3/6 rounds to x.
  if (size < 0x1p-26) return x;
  double nearest = 0;
  if (size < 0x1p-8) {
    // The terms beyond x are below 2^-18 of it; four roundings of them are below 2^-69 of it, the
    // next term below 2^-82.
    const double xx = x * x;
    const double beyond = x * xx * (-1.0 / 6 + xx * (1.0 / 120 - xx * (1.0 / 5040)));
    if (RoundsTo(FastSum(x, beyond), size * 0x1p-68, &nearest)) return nearest;
  } else if (size <= 1024) {
    if (TableSine(x, 0, &nearest)) return nearest;
  }
  return Exactly(mpfr_sin, x);
}

double Cosine(double x) {
  const double size = Magnitude(x);
  // 1 - x^2/2 rounds to 1.
  if (size < 0x1p-27) return 1;
  double nearest = 0;
  if (size < 0x1p-8) {
    // The terms beyond 1 are below 2^-17; three roundings of them are below 2^-67, the next term
    // below 2^-100.
    const double xx = x * x;
    const double beyond = xx * (-0.5 + xx * (1.0 / 24 + xx * (-1.0 / 720 + xx * (1.0 / 40320))));
    if (RoundsTo(FastSum(1, beyond), 0x1p-66, &nearest)) return nearest;
  } else if (size <= 1024) {
    if (TableSine(x, 1, &nearest)) return nearest;
  }
  return Exactly(mpfr_cos, x);
}

}  // namespace morphbus::elementary
