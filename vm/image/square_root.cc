#include "vm/image/square_root.h"

#include <cstdint>
#include <cstring>

// Processors that microcontrollers have take the root of a float, if of anything.
#if !defined(MORPHBUS_VM_SMALL)
#include <cmath>
#elif defined(__ARM_FP)
#include <cmath>
#define MORPHBUS_VM_ROOT_BY_DIGITS 1
#else
#define MORPHBUS_VM_ROOT_BY_DIGITS 1
#define MORPHBUS_VM_FLOAT_ROOT_BY_DIGITS 1
#endif

namespace morphbus::vm {

float SquareRoot(float x) {
#ifdef MORPHBUS_VM_FLOAT_ROOT_BY_DIGITS
  // A double has more than twice a float's digits, so that rounding twice does no harm.
  return static_cast<float>(SquareRootByDigits(static_cast<double>(x)));
#else
  return std::sqrt(x);
#endif
}

double SquareRoot(double x) {
#ifdef MORPHBUS_VM_ROOT_BY_DIGITS
  return SquareRootByDigits(x);
#else
  return std::sqrt(x);
#endif
}

double SquareRootByDigits(double x) {
  constexpr int kMantissaBits = 52;
  constexpr int kInfinity = 0x7ff;
  uint64_t bits;
  std::memcpy(&bits, &x, 8);
  const int field = static_cast<int>(bits >> kMantissaBits);
  // Zeros of both signs, infinity and what is no number are their own roots.
  if (bits << 1 == 0 || (field & kInfinity) == kInfinity) return x < 0 ? x - x : x;
  if (x < 0) return __builtin_nan("");
  // x = number * 2^exponent, where the number has 53 or 54 bits and the exponent is even.
  uint64_t number = bits & ((uint64_t{1} << kMantissaBits) - 1);
  int exponent = (field == 0 ? 1 : field) - 1075;
  if (field != 0) number |= uint64_t{1} << kMantissaBits;
  for (; number >> kMantissaBits == 0; --exponent) number <<= 1;
  if ((exponent & 1) != 0) {
    number <<= 1;
    --exponent;
  }
  // The root of number * 2^54 has 54 bits: each round takes two bits, the highest first, and finds
  // one of the root, as on paper.
  uint64_t root = 0, rest = 0;
  for (int round = 0; round < 54; ++round) {
    rest = rest << 2 | (number >> kMantissaBits & 3);
    number <<= 2;
    const uint64_t trial = root << 2 | 1;
    root <<= 1;
    if (rest >= trial) {
      rest -= trial;
      root |= 1;
    }
  }
  // The last bit decides whether to round up; a tie would be the square of a number with one bit
  // more, which no double is. The mantissa's highest bit adds one to the exponent's field.
  bits =
      (static_cast<uint64_t>((exponent - 54) / 2 + 1 + 1074) << kMantissaBits) + ((root + 1) >> 1);
  std::memcpy(&x, &bits, 8);
  return x;
}

}  // namespace morphbus::vm
