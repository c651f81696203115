#include "vm/image/sine.h"

#include <cstdint>

namespace morphbus::vm {

double SineSeries(double x) {
  constexpr double kTerms[] = {1.0 / 6227020800, -1.0 / 39916800, 1.0 / 362880,
                               -1.0 / 5040,      1.0 / 120,       -1.0 / 6};
  double sum = 0;
  for (const double term : kTerms) sum = sum * (x * x) + term;
  return x + x * (x * x) * sum;
}

double CosineSeries(double x) {
  constexpr double kTerms[] = {1.0 / 479001600, -1.0 / 3628800, 1.0 / 40320,
                               -1.0 / 720,      1.0 / 24,       -1.0 / 2};
  double sum = 0;
  for (const double term : kTerms) sum = sum * (x * x) + term;
  return 1 + (x * x) * sum;
}

SineCosine SineCosineOf(float angle_rad) {
  // A quarter turn in two parts (Cody and Waite 1980): products of the first, which has 33 bits,
  // are exact for up to 2^20 quarters.
  constexpr double kQuarterHigh = 1.57079632673412561417e+00;
  constexpr double kQuarterLow = 6.07710050650619224932e-11;
  constexpr double kQuartersARadian = 0.63661977236758134308;
  const auto x = static_cast<double>(angle_rad);
  if (!(x > -1e9 && x < 1e9)) return {0, 1};
  const auto nearest = static_cast<int32_t>(x * kQuartersARadian + (x < 0 ? -0.5 : 0.5));
  const double rest = (x - nearest * kQuarterHigh) - nearest * kQuarterLow;
  const double s = SineSeries(rest), c = CosineSeries(rest);
  // A quarter further the sine is the cosine, two further both have the other sign.
  const auto quarter = static_cast<uint32_t>(nearest) & 3;
  const double sine = quarter % 2 == 0 ? s : c;
  const double cosine = quarter % 2 == 0 ? c : s;
  return {static_cast<float>(quarter >= 2 ? -sine : sine),
          static_cast<float>(quarter == 1 || quarter == 2 ? -cosine : cosine)};
}

}  // namespace morphbus::vm
