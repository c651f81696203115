#include "compiler/elementary/logarithm.h"

#include <array>
#include <bit>
#include <cstdint>
#include <limits>

#include "compiler/elementary/double_double.h"
#include "compiler/elementary/exact.h"

namespace morphbus::elementary {
namespace {

/// Mantissas are in [3/4, 3/2), and the nearest k / 128 has k of 96 to 192.
constexpr int kPerUnit = 128, kFirst = 96, kLast = 192;
constexpr DoubleDouble kLog2 = {0x1.62e42fefa39efp-1, 0x1.abc9e3b39803fp-56};

/// A number of few bits near 128 / k, 1 for k = 128, and minus its logarithm.
struct Step {
  double inverse = 0;
  DoubleDouble logarithm;
};

/// log(a) = 2 atanh((a - 1) / (a + 1)), for a from 2/3 to 4/3.
constexpr DoubleDouble SeriesLogarithm(double a) {
  const DoubleDouble t = DoubleDouble{a - 1, 0} / DoubleDouble{a + 1, 0};
  const DoubleDouble square = t * t;
  DoubleDouble power = t, sum = t;
  for (int n = 3; n < 52; n += 2) {
    power = power * square;
    sum = sum + power / DoubleDouble{static_cast<double>(n), 0};
  }
  return sum + sum;
}

constexpr std::array<Step, kLast - kFirst + 1> Steps() {
  std::array<Step, kLast - kFirst + 1> steps{};
  for (int k = kFirst; k <= kLast; ++k) {
    const double inverse = static_cast<int>(1024.0 * kPerUnit / k + 0.5) / 1024.0;
    steps[k - kFirst] = {inverse, -SeriesLogarithm(inverse)};
  }
  return steps;
}
constexpr std::array<Step, kLast - kFirst + 1> kTable = Steps();

}  // namespace

double Logarithm(double x) {
  if (!(x >= std::numeric_limits<double>::min() && x <= std::numeric_limits<double>::max()))
    return Exactly(mpfr_log, x);
  if (x == 1) return 0;
  // x = mantissa * 2^exponent, the mantissa in [3/4, 3/2): so next to 1 the exponent is 0 and
  // nothing cancels.
  constexpr uint64_t kThreeQuarters = std::bit_cast<uint64_t>(0.75);
  const uint64_t bits = std::bit_cast<uint64_t>(x);
  const auto exponent = static_cast<int>(static_cast<int64_t>(bits - kThreeQuarters) >> 52);
  const auto mantissa =
      std::bit_cast<double>(bits - (static_cast<uint64_t>(static_cast<int64_t>(exponent)) << 52));

  // log x = exponent * log 2 + the step's logarithm + log(1 + r).
  const Step& step = kTable[static_cast<int>(mantissa * kPerUnit + 0.5) - kFirst];
  const DoubleDouble product = Product(mantissa, step.inverse);
  const DoubleDouble rest = FastSum(product.hi - 1, product.lo);
  // |r| < 2^-7.1; r - r^2/2 in two doubles, the terms beyond, below 2^-22.8, in plain ones.
  const double r = rest.hi;
  const DoubleDouble square = Product(r, r);
  const double beyond =
      r * square.hi *
      (1.0 / 3 +
       r * (-1.0 / 4 +
            r * (1.0 / 5 + r * (-1.0 / 6 +
                                r * (1.0 / 7 + r * (-1.0 / 8 + r * (1.0 / 9 - r * (1.0 / 10))))))));
  const DoubleDouble parabola = Sum(r, -0.5 * square.hi);
  const DoubleDouble near =
      FastSum(parabola.hi, parabola.lo + (beyond + (rest.lo - (0.5 * square.lo + r * rest.lo))));
  const DoubleDouble scale = kLog2 * DoubleDouble{static_cast<double>(exponent), 0};
  const DoubleDouble sum = (scale + step.logarithm) + near;
  // Beside the step of 1 a logarithm is above 2^-8.1 and the error of the terms beyond below 2^-74;
  // at it that error is below 2^-68 of r. So it is right to 2^-65 of itself.
  double nearest = 0;
  if (RoundsTo(sum, (sum.hi < 0 ? -sum.hi : sum.hi) * 0x1p-64, &nearest)) return nearest;
  return Exactly(mpfr_log, x);
}

}  // namespace morphbus::elementary
