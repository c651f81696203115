#pragma once
// Random numbers of a normal distribution, the same on every machine.

#include <cmath>
#include <cstdint>
#include <numbers>

namespace morphbus::elementary {

/// One draw of a normal distribution with mean 0 and this standard deviation, by Box and Muller's
/// method: the standard library's distribution differs from one to the next. `next` gives 64 random
/// bits, and is asked twice.
template <class Next>
double Gaussian(double deviation, Next&& next) {
  constexpr double kUnit = 1.0 / 9007199254740992.0;  // 2^-53
  // Half a unit keeps the first number from 0, whose logarithm is infinite.
  const double u = (static_cast<double>(next() >> 11) + 0.5) * kUnit;
  const double turn = static_cast<double>(next() >> 11) * kUnit * 2 * std::numbers::pi;
  return deviation * std::sqrt(-2 * std::log(u)) * std::cos(turn);
}

}  // namespace morphbus::elementary
