#include "vm/run/mathematics.h"

#include <cstring>

#include "vm/image/sine.h"
#include "vm/image/square_root.h"
#include "vm/limits.h"

namespace morphbus::vm {
namespace {

constexpr double kRadian = 0.017453292519943295769;  // In one degree.
constexpr float kNoValue = __builtin_nanf("");

/// Sine of so many degrees, turned on by so many quarters: sin(a + 90 * quarters).
double Sine(float degrees, int quarters) {
  // The remainder is exact, and so is its distance from the nearest multiple of 90.
  const float turn = Modulo(degrees, 360.0f);
  const int nearest = static_cast<int>(turn / 90 + (turn < 0 ? -0.5f : 0.5f));
  const double x = (static_cast<double>(turn) - 90.0 * nearest) * kRadian;
  // A quarter further the sine is the cosine, two further it has the other sign.
  const int quarter = (nearest + quarters + 8) % 4;
  const double value = quarter % 2 == 0 ? SineSeries(x) : CosineSeries(x);
  return quarter >= 2 ? -value : value;
}

/// Degrees of the arc whose tangent is `t`, 0 <= t <= 1.
double ArcTangent(double t) {
  // Above the tangent of 22.5 degrees, half of 45, the rest beyond 45 is smaller.
  const bool beyond = t > 0.41421356;
  if (beyond) t = (t - 1) / (t + 1);
  // Gregory's series; the first term left out is below 1e-13.
  double sum = 0;
  for (int n = 31; n >= 1; n -= 2) sum = (n % 4 == 1 ? 1.0 : -1.0) / n + sum * (t * t);
  return t * sum / kRadian + (beyond ? 45 : 0);
}

/// Degrees from the x axis to the point (x, y).
double Arc(double y, double x) {
  const double a = x < 0 ? -x : x;
  const double b = y < 0 ? -y : y;
  if (a <= 0 && b <= 0) return 0;
  // The first half of the first quarter, then the rest of the circle by its symmetries.
  double degrees = b > a ? 90 - ArcTangent(a / b) : ArcTangent(b / a);
  if (x < 0) degrees = 180 - degrees;
  return y < 0 ? -degrees : degrees;
}

/// The whole number next to `x` toward zero. From 2^23 on all floats are whole.
float Truncate(float x) {
  const float size = x < 0 ? -x : x;
  return size < 8388608.0f ? static_cast<float>(static_cast<int32_t>(x)) : x;
}

float Floor(float x) {
  const float whole = Truncate(x);
  return whole > x ? whole - 1 : whole;
}

/// Halves go away from zero. The part behind the point is exact.
float Round(float x) {
  const float whole = Truncate(x);
  const float rest = x - whole;
  if (rest >= 0.5f) return whole + 1;
  return rest <= -0.5f ? whole - 1 : whole;
}

/// 2 to the power of n, -1022 <= n <= 1023.
double PowerOfTwo(int n) {
  const uint64_t bits = static_cast<uint64_t>(n + 1023) << 52;
  double power;
  std::memcpy(&power, &bits, 8);
  return power;
}

// The logarithm of 2 in two parts: products of the first, which has 33 bits, with small whole
// numbers are exact (Cody and Waite 1980).
constexpr double kLog2High = 6.93147180369123816490e-01;
constexpr double kLog2Low = 1.90821492927058770002e-10;

/// e to the power of x, for -200 < x < 200: what is left of x beside a multiple of the logarithm of
/// 2 is at most half of that, and Taylor's first term left out is below 1e-16.
double Exponential(double x) {
  const int n = static_cast<int>(x / kLog2High + (x < 0 ? -0.5 : 0.5));
  const double rest = (x - n * kLog2High) - n * kLog2Low;
  double sum = 1;
  for (int k = 13; k >= 1; --k) sum = 1 + rest / k * sum;
  return sum * PowerOfTwo(n);
}

/// The natural logarithm of x > 0, which is no smaller than a float: x is m times a power of 2 with
/// m from √½ to √2, and log m = 2 artanh((m - 1) / (m + 1)); the first term left out is below
/// 1e-17.
double Logarithm(double x) {
  uint64_t bits;
  std::memcpy(&bits, &x, 8);
  int n = static_cast<int>(bits >> 52) - 1023;
  double m = x / PowerOfTwo(n);
  if (m > 1.4142135623730951) {
    m /= 2;
    ++n;
  }
  const double t = (m - 1) / (m + 1);
  double sum = 0;
  for (int k = 21; k >= 1; k -= 2) sum = 1.0 / k + sum * (t * t);
  return n * kLog2High + (n * kLog2Low + 2 * t * sum);
}

/// e to the power of x as a float; beyond its range it is none, or 0.
float ExponentialOf(double x) {
  // The logarithm of the largest float.
  if (x > 88.722839) return kNoValue;
  return x < -110 ? 0.0f : static_cast<float>(Exponential(x));
}

/// `a` to the power of `b`: of negative numbers only whole powers have a value.
float Power(float a, float b) {
  // Whatever is raised to 0 is 1, and 1 to any power, also where a logarithm would not help.
  if ((b <= 0 && b >= 0) || (a <= 1 && a >= 1)) return 1;
  if (a <= 0 && a >= 0) return b > 0 ? 0.0f : kNoValue;
  const float whole = Truncate(b);
  if (a < 0 && (whole < b || whole > b)) return kNoValue;
  const bool odd = Modulo(b, 2.0f) < 0 || Modulo(b, 2.0f) > 0;
  const float size =
      ExponentialOf(static_cast<double>(b) * Logarithm(static_cast<double>(a < 0 ? -a : a)));
  return a < 0 && odd ? -size : size;
}

/// The functions of the large profile.
float Powers(Opcode function, float a, float b) {
  switch (function) {
    case Opcode::kExp:
      return ExponentialOf(static_cast<double>(a));
    case Opcode::kLog:
      return a > 0 ? static_cast<float>(Logarithm(static_cast<double>(a))) + 0.0f : kNoValue;
    case Opcode::kPow:
      return Power(a, b);
    default:
      return kNoValue;
  }
}

/// The other side of a right triangle with hypotenuse 1; the product is nearly exact also where `x`
/// is close to 1.
double OtherSide(double x) { return SquareRoot((1 - x) * (1 + x)); }

/// A float's size as a whole number of so many units of 2^exponent; the exponent counts from that
/// of the smallest floats, which is 1.
struct Scaled {
  uint32_t number;
  int exponent;
};

Scaled ScaledOf(uint32_t bits) {
  const auto exponent = static_cast<int>(bits >> 23);
  if (exponent == 0) return {bits, 1};
  return {(bits & 0x7fffffu) | 0x800000u, exponent};
}

}  // namespace

// Long division: what is left is doubled for each power of two between the operands. All numbers
// are whole and stay below 2^25.
float Modulo(float a, float b) {
  uint32_t bits_a, bits_b;
  std::memcpy(&bits_a, &a, 4);
  std::memcpy(&bits_b, &b, 4);
  // The result has the sign of a, as fmod's; the division is of sizes.
  const uint32_t sign = bits_a & 0x80000000u;
  // Both sizes as whole numbers of units: a is rest times 2^exponent, b likewise.
  auto [rest, exponent] = ScaledOf(bits_a & 0x7fffffffu);
  const Scaled divisor = ScaledOf(bits_b & 0x7fffffffu);
  // Floats of one sign are in the order of their bits.
  if ((bits_a & 0x7fffffffu) < (bits_b & 0x7fffffffu)) return a;
  rest %= divisor.number;
  for (; exponent > divisor.exponent && rest != 0; --exponent) {
    rest <<= 1;
    if (rest >= divisor.number) rest -= divisor.number;
  }
  // Back to a float: its highest bit at its place, unless it is one of the smallest.
  exponent = divisor.exponent;
  while (rest != 0 && rest < 0x800000u && exponent > 1) {
    rest <<= 1;
    --exponent;
  }
  uint32_t bits = sign;
  bits |= rest < 0x800000u ? rest : static_cast<uint32_t>(exponent) << 23 | (rest & 0x7fffffu);
  float result;
  std::memcpy(&result, &bits, 4);
  return result;
}

bool ToInt(float x, int32_t* number) {
  // The next float below the largest int, and the smallest int, are exact.
  if (!(x > -2147483904.0f && x < 2147483648.0f)) return false;
  *number = static_cast<int32_t>(x);
  return true;
}

float Mathematics(Opcode function, float a, float b) {
  const auto wide = static_cast<double>(a);
  switch (function) {
    // A zero has no sign, as programs could not tell.
    case Opcode::kSin:
      return static_cast<float>(Sine(a, 0)) + 0.0f;
    case Opcode::kCos:
      return static_cast<float>(Sine(a, 1)) + 0.0f;
    // At a cosine of 0 there is no tangent.
    case Opcode::kTan: {
      const double cosine = Sine(a, 1);
      if (cosine <= 0 && cosine >= 0) return kNoValue;
      return static_cast<float>(Sine(a, 0) / cosine) + 0.0f;
    }
    // arcsin x is the angle of the vector (√(1 − x²), x), and arccos x that of (x, √(1 − x²)).
    case Opcode::kAsin:
      if (!(wide >= -1 && wide <= 1)) return kNoValue;
      return static_cast<float>(Arc(wide, OtherSide(wide)));
    case Opcode::kAcos:
      if (!(wide >= -1 && wide <= 1)) return kNoValue;
      return static_cast<float>(Arc(OtherSide(wide), wide));
    case Opcode::kAtan2:
      return static_cast<float>(Arc(wide, static_cast<double>(b)));
    case Opcode::kSqrt:
      return a < 0 ? kNoValue : SquareRoot(a);
    case Opcode::kAbs:
      return a < 0 ? -a : a + 0.0f;
    case Opcode::kMin:
      return b < a ? b : a;
    case Opcode::kMax:
      return b > a ? b : a;
    case Opcode::kFloor:
      return Floor(a);
    case Opcode::kRound:
      return Round(a);
    case Opcode::kSign:
      return a > 0 ? 1.0f : a < 0 ? -1.0f : 0.0f;
    default:
      break;
  }
  if constexpr (kHoldsAllInstructions) return Powers(function, a, b);
  return kNoValue;
}

}  // namespace morphbus::vm
