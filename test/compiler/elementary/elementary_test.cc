#include <gtest/gtest.h>
#include <mpfr.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>
#include <vector>

// The elementary functions of this program, which come from compiler/elementary, against MPFR with
// 200 bits, which are then rounded to a double: equal to the bit. (Of the functions that
// compiler/elementary itself takes from MPFR, at 53 bits, it is shown that they are these, and that
// subnormal and infinite results are right.)
//
// A million arguments a function; MORPHBUS_ELEMENTARY_ARGUMENTS=100000000 tries as many.

namespace {

/// A function of MPFR's, of one number.
using OfOne = int (*)(mpfr_t, const mpfr_t, mpfr_rnd_t);
using OfTwo = int (*)(mpfr_t, const mpfr_t, const mpfr_t, mpfr_rnd_t);

/// Rounds by way of 200 bits. No function here has a double as argument whose result is so near the
/// middle of two doubles that it matters, other than exactly in it.
class Reference {
 public:
  Reference() { mpfr_inits2(200, x_, y_, result_, nullptr); }
  ~Reference() { mpfr_clears(x_, y_, result_, nullptr); }
  Reference(const Reference&) = delete;
  Reference& operator=(const Reference&) = delete;

  double operator()(OfOne function, double x, double /*y*/) {
    mpfr_set_d(x_, x, MPFR_RNDN);
    function(result_, x_, MPFR_RNDN);
    return mpfr_get_d(result_, MPFR_RNDN);
  }
  double operator()(OfTwo function, double x, double y) {
    mpfr_set_d(x_, x, MPFR_RNDN);
    mpfr_set_d(y_, y, MPFR_RNDN);
    function(result_, x_, y_, MPFR_RNDN);
    return mpfr_get_d(result_, MPFR_RNDN);
  }

 private:
  mpfr_t x_, y_, result_;
};

bool Same(double a, double b) {
  return std::isnan(a) ? std::isnan(b) && !std::signbit(a)
                       : std::bit_cast<uint64_t>(a) == std::bit_cast<uint64_t>(b);
}

int64_t Arguments() {
  const char* wanted = std::getenv("MORPHBUS_ELEMENTARY_ARGUMENTS");
  return wanted != nullptr ? std::stoll(wanted) : 1'000'000;
}

/// Where functions are hard: ends of ranges, of the intervals that the code knows, neighbours of
/// where results vanish.
std::vector<double> HardArguments() {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::vector<double> around = {0,
                                0x1p-1074,
                                0x1p-1022,
                                1,
                                2,
                                0.5,
                                0.75,
                                1.5,
                                1024,
                                0x1p53,
                                709.782712893384,
                                745.1332191019412,
                                std::numeric_limits<double>::max()};
  for (int e = -70; e <= 12; ++e) around.push_back(std::ldexp(1.0, e));
  for (const int e : {-600, -301, -300, -299, 299, 300, 301, 600})
    around.push_back(std::ldexp(1.0, e));
  for (int k = 1; k <= 700; ++k) {
    around.push_back(k * 0x1.921fb54442d18p+0);          // multiples of pi/2
    around.push_back((k - 0.5) * 0x1.921fb54442d18p-7);  // between two steps of the table of sines
    around.push_back((k - 0.5) / 128);                   // of arc tangents and logarithms
    around.push_back(k / 128.0);
  }
  // The double nearest to a multiple of pi/2, and bad cases of logarithm, sine and cosine. V.
  // Lefèvre, J.-M. Muller, "Worst cases for correct rounding of the elementary functions in double
  // precision", 2001; W. Kahan's for the first.
  for (const double x : {0x1.6ac5b262ca1ffp+849, 0x1.62a88613629b5p+678, 0x1.ea71d85cee020p-509,
                         0x1.ab50b409c8aeep+8, 0x1.9476e304cd7c7p+384, 0x1.e0000000001c2p-20,
                         0x1.8000000000009p-23}) {
    around.push_back(x);
  }
  std::vector<double> all = {kInfinity, -kInfinity, std::numeric_limits<double>::quiet_NaN()};
  for (const double x : around) {
    double below = x, above = x;
    for (int i = 0; i < 3; ++i) {
      for (const double y : {below, above, -below, -above}) all.push_back(y);
      below = std::nextafter(below, -kInfinity);
      above = std::nextafter(above, kInfinity);
    }
  }
  return all;
}

/// Arguments as they come in runs, and any at all.
class Draw {
 public:
  double operator()() {
    const uint64_t bits = random_();
    const double unit = static_cast<double>(random_() >> 11) * 0x1p-53;
    const double sign = (bits & 1) != 0 ? -1 : 1;
    switch (bits >> 61) {
      case 0:
        return std::bit_cast<double>(random_());  // all doubles there are
      case 1:
        return sign * std::ldexp(1 + unit, static_cast<int>(bits >> 8) % 40 - 30);
      case 2:
        return sign * unit * 1e-2;
      case 3:
        return 1 + sign * unit * 0x1p-6;
      case 4:
        return sign * unit * 1100;
      default:
        return sign * unit * (bits >> 61 == 5 ? 1 : 4);
    }
  }

 private:
  std::mt19937_64 random_{20260721};
};

/// Expects `ours` to be correctly rounded, for hard arguments and for `count` others.
template <typename Function, typename Ours>
void ExpectRounded(Function function, Ours ours, int64_t count) {
  constexpr bool kOfTwo = std::is_same_v<Function, OfTwo>;
  Reference reference;
  int wrong = 0;
  const auto expect = [&](double x, double y) {
    const double is = ours(x, y), should = reference(function, x, y);
    if (Same(is, should) || ++wrong > 10) return;
    ADD_FAILURE() << std::hexfloat << "of " << x << " and " << y << ": " << is << " instead of "
                  << should;
  };
  const std::vector<double> hard = HardArguments();
  for (const double x : hard) expect(x, 1);
  if (kOfTwo) {
    for (const double x :
         {0.0, -0.0, 1.0, -1.0, 1e-300, 0.3, std::numeric_limits<double>::infinity()}) {
      for (const double y : hard) expect(x, y);
    }
  }
  Draw draw;
  for (int64_t i = 0; i < count; ++i) {
    const double x = draw();
    expect(x, kOfTwo ? draw() : 1);
  }
  EXPECT_EQ(wrong, 0);
}

#define OF_ONE(name) \
  ExpectRounded(     \
      OfOne{mpfr_##name}, [](double x, double) { return std::name(x); }, count)
#define OF_TWO(name) \
  ExpectRounded(     \
      OfTwo{mpfr_##name}, [](double x, double y) { return std::name(x, y); }, count)

}  // namespace

namespace morphbus {

TEST(Elementary, SineIsCorrectlyRounded) {
  const int64_t count = Arguments();
  OF_ONE(sin);
}

TEST(Elementary, CosineIsCorrectlyRounded) {
  const int64_t count = Arguments();
  OF_ONE(cos);
}

TEST(Elementary, ArcTangentIsCorrectlyRounded) {
  const int64_t count = Arguments();
  OF_ONE(atan);
}

TEST(Elementary, ArcTangentOfQuotientIsCorrectlyRounded) {
  const int64_t count = Arguments();
  OF_TWO(atan2);
}

TEST(Elementary, ArcSineIsCorrectlyRounded) {
  const int64_t count = Arguments();
  OF_ONE(asin);
}

TEST(Elementary, ArcCosineIsCorrectlyRounded) {
  const int64_t count = Arguments();
  OF_ONE(acos);
}

TEST(Elementary, LogarithmIsCorrectlyRounded) {
  const int64_t count = Arguments();
  OF_ONE(log);
}

TEST(Elementary, OthersAreMpfrsWithTheRangeOfDoubles) {
  const int64_t count = Arguments() / 200;
  OF_ONE(tan);
  OF_ONE(sinh);
  OF_ONE(cosh);
  OF_ONE(tanh);
  OF_ONE(asinh);
  OF_ONE(acosh);
  OF_ONE(atanh);
  OF_ONE(exp);
  OF_ONE(exp2);
  OF_ONE(expm1);
  OF_ONE(log2);
  OF_ONE(log10);
  OF_ONE(log1p);
  OF_ONE(cbrt);
  OF_TWO(pow);
  OF_TWO(hypot);
}

TEST(Elementary, BothAtOnceAreTheTwo) {
  Draw draw;
  for (int i = 0; i < 10000; ++i) {
    const double x = draw();
    double sine = 0, cosine = 0;
    sincos(x, &sine, &cosine);
    EXPECT_TRUE(Same(sine, std::sin(x)) && Same(cosine, std::cos(x))) << x;
  }
}

TEST(Elementary, FloatsAreTheDoublesRounded) {
  Draw draw;
  for (int i = 0; i < 10000; ++i) {
    const auto x = static_cast<float>(draw()), y = static_cast<float>(draw());
    const auto same = [x, y](float is, double should) {
      EXPECT_TRUE(Same(is, static_cast<float>(should))) << x << ", " << y;
    };
    const double wide = x;
    same(std::sin(x), std::sin(wide));
    same(std::cos(x), std::cos(wide));
    same(std::tan(x), std::tan(wide));
    same(std::acos(x), std::acos(wide));
    same(std::asin(x), std::asin(wide));
    same(std::atan2(x, y), std::atan2(wide, static_cast<double>(y)));
    same(std::exp(x), std::exp(wide));
    same(std::pow(x, y), std::pow(wide, static_cast<double>(y)));
    float sine = 0, cosine = 0;
    sincosf(x, &sine, &cosine);
    same(sine, std::sin(wide));
    same(cosine, std::cos(wide));
  }
}

}  // namespace morphbus
