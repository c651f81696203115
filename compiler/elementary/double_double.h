#pragma once

/// Numbers as sums of two doubles, some 106 bits, from double operations alone: each is exact or
/// rounds as IEEE 754 says, so that every machine gets the same two. T. J. Dekker, "A
/// floating-point technique for extending the available precision", Numerische Mathematik 18
/// (1971); M. Joldes, J.-M. Muller, V. Popescu, "Tight and rigorous error bounds for basic building
/// blocks of double-word arithmetic", ACM Transactions on Mathematical Software 44 (2017).
///
/// All of it holds while nothing overflows and no product is below 2^-960; who calls sees to that.
namespace morphbus::elementary {

/// hi + lo, with hi the double nearest to the sum.
struct DoubleDouble {
  double hi = 0;
  double lo = 0;  ///< At most half a unit in the last place of `hi`.
};

/// a + b exactly, where |a| >= |b| or a is 0 (Dekker's Fast2Sum).
constexpr DoubleDouble FastSum(double a, double b) {
  const double sum = a + b;
  return {sum, b - (sum - a)};
}

/// a + b exactly (Knuth's 2Sum).
constexpr DoubleDouble Sum(double a, double b) {
  const double sum = a + b;
  const double of_b = sum - a;
  return {sum, (a - (sum - of_b)) + (b - of_b)};
}

/// x as the sum of two halves of at most 26 bits, so that products of halves are exact (Veltkamp's
/// splitting; the factor is 2^27 + 1).
constexpr DoubleDouble Halves(double x) {
  const double big = 134217729.0 * x;  // 2^27 + 1
  const double upper = big - (big - x);
  return {upper, x - upper};
}

/// a * b exactly (Dekker's product). A fused multiply-add would give the same two numbers, but not
/// every processor has one.
constexpr DoubleDouble Product(double a, double b) {
  const double product = a * b;
  const DoubleDouble x = Halves(a), y = Halves(b);
  return {product, ((x.hi * y.hi - product) + x.hi * y.lo + x.lo * y.hi) + x.lo * y.lo};
}

/// Exact: a sign is a bit of its own.
constexpr DoubleDouble operator-(const DoubleDouble& a) { return {-a.hi, -a.lo}; }

/// Relative error at most 2^-104, also where a and b nearly cancel each other, for which the low
/// parts are added exactly, too.
constexpr DoubleDouble operator+(const DoubleDouble& a, const DoubleDouble& b) {
  const DoubleDouble upper = Sum(a.hi, b.hi), lower = Sum(a.lo, b.lo);
  const DoubleDouble both = FastSum(upper.hi, upper.lo + lower.hi);
  return FastSum(both.hi, lower.lo + both.lo);
}

/// The relative error is that of the sum.
constexpr DoubleDouble operator-(const DoubleDouble& a, const DoubleDouble& b) { return a + -b; }

/// Relative error at most 2^-102: the product of both low parts, which is smaller, is left out.
constexpr DoubleDouble operator*(const DoubleDouble& a, const DoubleDouble& b) {
  const DoubleDouble upper = Product(a.hi, b.hi);
  return FastSum(upper.hi, upper.lo + (a.hi * b.lo + a.lo * b.hi));
}

/// Relative error at most 2^-101.
constexpr DoubleDouble operator/(const DoubleDouble& a, const DoubleDouble& b) {
  const double quotient = a.hi / b.hi;
  const DoubleDouble back = Product(quotient, b.hi);
  // The first difference is exact, as the two lie within a rounding of each other.
  const double rest = ((a.hi - back.hi) - back.lo) + (a.lo - quotient * b.lo);
  return FastSum(quotient, rest / b.hi);
}

/// Sets `nearest` to the double nearest to a number of which is only known that it lies within
/// `error` of hi + lo (Ziv's rounding test); false if more than one could be.
constexpr bool RoundsTo(const DoubleDouble& x, double error, double* nearest) {
  *nearest = x.hi + (x.lo + error);
  return *nearest == x.hi + (x.lo - error);
}

}  // namespace morphbus::elementary
