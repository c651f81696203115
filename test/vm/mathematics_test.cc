#include "vm/run/mathematics.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include "test/vm/image_builder.h"
#include "vm/image/square_root.h"
#include "vm/run/cells.h"

namespace morphbus::vm {
namespace {

constexpr double kRadian = M_PI / 180;

/// The distance of `value` from what it should be, in units in the last place of the latter.
double Error(float value, double exact) {
  const float size = std::fabs(static_cast<float>(exact));
  const double unit = static_cast<double>(std::nextafter(size, INFINITY) - size);
  return std::fabs(static_cast<double>(value) - exact) / unit;
}

/// Calls `check` with numbers of every size up to `most`, of both signs.
template <class Check>
void ForMany(double most, const Check& check) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> even(-1, 1), exponent(-12, 0);
  for (int i = 0; i < 20000; ++i) {
    check(static_cast<float>(most * even(random)));
    check(static_cast<float>(most * std::pow(10, exponent(random)) * (even(random) < 0 ? -1 : 1)));
  }
}

// The host's library in double precision is the other route; its error is far below a float's unit.
TEST(MathematicsTest, SineAndItsKinAreWithinAUnitInTheLastPlace) {
  ForMany(720, [](float x) {
    const double angle = std::remainder(static_cast<double>(x), 360.0) * kRadian;
    ASSERT_LE(Error(Mathematics(Opcode::kTan, x, 0), std::tan(angle)), 1.0) << x;
    // Close to a zero the library's angle is off by its own rounding of pi.
    if (std::fabs(std::sin(angle)) > 1e-6) {
      ASSERT_LE(Error(Mathematics(Opcode::kSin, x, 0), std::sin(angle)), 0.51) << x;
    }
    if (std::fabs(std::cos(angle)) > 1e-6) {
      ASSERT_LE(Error(Mathematics(Opcode::kCos, x, 0), std::cos(angle)), 0.51) << x;
    }
  });
}

TEST(MathematicsTest, ArcsAreWithinAUnitInTheLastPlace) {
  ForMany(1, [](float x) {
    const auto wide = static_cast<double>(x);
    ASSERT_LE(Error(Mathematics(Opcode::kAsin, x, 0), std::asin(wide) / kRadian), 0.51) << x;
    ASSERT_LE(Error(Mathematics(Opcode::kAcos, x, 0), std::acos(wide) / kRadian), 0.51) << x;
    ASSERT_LE(Error(Mathematics(Opcode::kSqrt, std::fabs(x), 0), std::sqrt(std::fabs(wide))), 0.51);
  });
  float last = 1;
  ForMany(1000, [&last](float y) {
    ASSERT_LE(Error(Mathematics(Opcode::kAtan2, y, last),
                    std::atan2(static_cast<double>(y), static_cast<double>(last)) / kRadian),
              0.51)
        << y << " " << last;
    last = y;
  });
}

TEST(MathematicsTest, ExponentialsAndLogarithmsAreWithinAUnitInTheLastPlace) {
  ForMany(88, [](float x) {
    const auto wide = static_cast<double>(x);
    // Below it floats have fewer digits.
    if (x > -87) {
      ASSERT_LE(Error(Mathematics(Opcode::kExp, x, 0), std::exp(wide)), 0.51) << x;
    }
    const float size = std::fabs(x);
    if (size > 0) {
      ASSERT_LE(Error(Mathematics(Opcode::kLog, size, 0), std::log(std::fabs(wide))), 0.51) << x;
    }
  });
  // Close to 1, and of the smallest and largest floats.
  for (const float x : {0.99999994f, 1.0000001f, 1e-45f, 3.4028235e38f, 0.70710677f, 1.4142135f}) {
    EXPECT_LE(Error(Mathematics(Opcode::kLog, x, 0), std::log(static_cast<double>(x))), 0.51) << x;
  }
  EXPECT_EQ(Mathematics(Opcode::kExp, -200, 0), 0);
  EXPECT_FALSE(std::isfinite(Mathematics(Opcode::kExp, 89, 0)));
  EXPECT_FALSE(std::isfinite(Mathematics(Opcode::kExp, 1e30f, 0)));
  EXPECT_FALSE(std::isfinite(Mathematics(Opcode::kLog, 0, 0)));
  EXPECT_FALSE(std::isfinite(Mathematics(Opcode::kLog, -1, 0)));
}

TEST(MathematicsTest, PowersAreWithinAUnitInTheLastPlace) {
  float last = 2;
  ForMany(100, [&last](float x) {
    const double size = std::fabs(static_cast<double>(x)), exponent = static_cast<double>(last) / 8;
    const double exact = std::pow(size, exponent);
    if (exact > 1e-37 && exact < 3e38) {
      ASSERT_LE(Error(Mathematics(Opcode::kPow, std::fabs(x), last / 8), exact), 0.51)
          << x << " " << last / 8;
    }
    last = x;
  });
  const struct {
    float a, b, power;
  } kKnown[] = {{-2, 3, -8}, {-2, 4, 16},   {-2, -1, -0.5f}, {0, 2, 0},    {0, 0, 1},
                {5, 0, 1},   {1, 1e30f, 1}, {-1, 3, -1},     {9, 0.5f, 3}, {10, -2, 0.01f}};
  for (const auto& [a, b, power] : kKnown) EXPECT_EQ(Mathematics(Opcode::kPow, a, b), power) << a;
  EXPECT_FALSE(std::isfinite(Mathematics(Opcode::kPow, -2, 0.5f)));
  EXPECT_FALSE(std::isfinite(Mathematics(Opcode::kPow, 0, -1)));
  EXPECT_FALSE(std::isfinite(Mathematics(Opcode::kPow, 1e20f, 2)));
}

TEST(MathematicsTest, FloatsThatFitBecomeInts) {
  int32_t number = 0;
  const struct {
    float x;
    int32_t number;
  } kKnown[] = {
      {0.0f, 0}, {2.9f, 2}, {-2.9f, -2}, {2147483520.0f, 2147483520}, {-2147483648.0f, INT32_MIN}};
  for (const auto& [x, expected] : kKnown) {
    ASSERT_TRUE(ToInt(x, &number)) << x;
    EXPECT_EQ(number, expected);
  }
  for (const float x : {2147483648.0f, -2147483904.0f, 1e30f}) EXPECT_FALSE(ToInt(x, &number)) << x;
  EXPECT_EQ(Mathematics(Opcode::kSign, 3.5f, 0), 1);
  EXPECT_EQ(Mathematics(Opcode::kSign, -1e-30f, 0), -1);
  EXPECT_EQ(Mathematics(Opcode::kSign, 0, 0), 0);
}

TEST(MathematicsTest, WholeNumbersAreThoseOfTheLibrary) {
  ForMany(1e9, [](float x) {
    ASSERT_EQ(Mathematics(Opcode::kFloor, x, 0), std::floor(x)) << x;
    ASSERT_EQ(Mathematics(Opcode::kRound, x, 0), std::round(x)) << x;
    ASSERT_EQ(Mathematics(Opcode::kAbs, x, 0), std::fabs(x)) << x;
  });
  for (const float x : {0.5f, -0.5f, 1.5f, 2.5f, -2.5f, 0.49999997f, 8388607.5f}) {
    EXPECT_EQ(Mathematics(Opcode::kRound, x, 0), std::round(x)) << x;
    EXPECT_EQ(Mathematics(Opcode::kFloor, x, 0), std::floor(x)) << x;
  }
}

TEST(MathematicsTest, MultiplesOfNinetyDegreesAreExact) {
  for (int k = -40; k <= 40; ++k) {
    const float x = 90.0f * static_cast<float>(k);
    const int quarter = (k % 4 + 4) % 4;
    constexpr float kSines[] = {0, 1, 0, -1};
    EXPECT_EQ(Mathematics(Opcode::kSin, x, 0), kSines[quarter]) << x;
    EXPECT_EQ(Mathematics(Opcode::kCos, x, 0), kSines[(quarter + 1) % 4]) << x;
    EXPECT_EQ(std::isfinite(Mathematics(Opcode::kTan, x, 0)), k % 2 == 0) << x;
  }
  EXPECT_EQ(Mathematics(Opcode::kSin, 30, 0), 0.5f);
  EXPECT_EQ(Mathematics(Opcode::kAtan2, 1, 1), 45.0f);
  EXPECT_EQ(Mathematics(Opcode::kAtan2, 0, -1), 180.0f);
  EXPECT_EQ(Mathematics(Opcode::kAcos, -1, 0), 180.0f);
  // The largest float is a whole number of degrees, whose remainder is known exactly.
  EXPECT_LE(Error(Mathematics(Opcode::kSin, 3.4028235e38f, 0),
                  std::sin(std::fmod(static_cast<double>(3.4028235e38f), 360.0) * kRadian)),
            0.51);
}

TEST(MathematicsTest, WhatHasNoValueIsNotFinite) {
  EXPECT_FALSE(std::isfinite(Mathematics(Opcode::kAsin, 1.0000001f, 0)));
  EXPECT_FALSE(std::isfinite(Mathematics(Opcode::kAcos, -1.0000001f, 0)));
  EXPECT_FALSE(std::isfinite(Mathematics(Opcode::kSqrt, -1e-30f, 0)));
}

// Any machine must give these bits; test/vm runs the same sources on every one that it is built
// for.
TEST(MathematicsTest, BitsAreThoseOfEveryMachine) {
  uint32_t digest = 2166136261u;
  uint32_t state = 12345;
  for (int i = 0; i < 200000; ++i) {
    state = state * 1664525u + 1013904223u;
    const float x = static_cast<float>(static_cast<int32_t>(state)) * (1.0f / 4194304);
    const auto function = static_cast<Opcode>(static_cast<int>(Opcode::kSin) + i % 12);
    const bool arc = function == Opcode::kAsin || function == Opcode::kAcos;
    const float value = Mathematics(function, arc ? x / 512 : x, 3.25f);
    digest = (digest ^ (std::isfinite(value) ? Bits(value) : 0u)) * 16777619u;
  }
  EXPECT_EQ(digest, 3701006266u);
}

// The host's processor has an instruction for it, which IEEE 754 defines to the last bit.
TEST(SquareRootTest, ByDigitsIsTheInstructions) {
  std::mt19937_64 random(2);
  const auto check = [](double x) {
    ASSERT_EQ(std::bit_cast<uint64_t>(SquareRootByDigits(x)), std::bit_cast<uint64_t>(std::sqrt(x)))
        << x;
  };
  // Doubles of every exponent, the smallest among them; floats; squares and their neighbours.
  for (int i = 0; i < 50000; ++i) {
    const double any = std::fabs(std::bit_cast<double>(random()));
    if (std::isfinite(any)) check(any);
    check(static_cast<double>(std::bit_cast<float>(static_cast<uint32_t>(random() >> 33))));
    const auto root = static_cast<double>(static_cast<uint32_t>(random()));
    check(root * root);
    check(std::nextafter(root * root, 0));
    check(std::bit_cast<double>(random() >> 12));
  }
  for (const double x :
       {0.0, -0.0, 1.0, 2.0, std::numeric_limits<double>::max(), std::numeric_limits<double>::min(),
        std::numeric_limits<double>::denorm_min()}) {
    check(x);
  }
  EXPECT_TRUE(std::isinf(SquareRootByDigits(INFINITY)));
  EXPECT_TRUE(std::isnan(SquareRootByDigits(-1)));
  EXPECT_TRUE(std::isnan(SquareRootByDigits(-INFINITY)));
  EXPECT_TRUE(std::isnan(SquareRootByDigits(NAN)));
}

TEST(MillisecondsTest, AreWholeOnesOrRefused) {
  const auto check = [](int64_t us) {
    int32_t ms = 0;
    const bool fits = us / 1000 <= INT32_MAX && us / 1000 >= -INT32_MAX;
    ASSERT_EQ(ToMilliseconds(us, &ms), fits) << us;
    if (fits) {
      ASSERT_EQ(ms, us / 1000) << us;
    }
  };
  std::mt19937_64 random(3);
  for (int i = 0; i < 50000; ++i) {
    const auto any = static_cast<int64_t>(random());
    check(any >> (i % 64));
    const int64_t whole = (any >> 33) * 1000;
    for (const int64_t us : {whole - 1, whole, whole + 1}) check(us);
  }
  for (const int64_t limit : {int64_t{INT32_MAX} * 1000, INT64_MAX, INT64_MIN}) {
    check(limit);
    if (limit < INT64_MAX && limit > INT64_MIN) {
      check(limit + 999);
      check(limit + 1000);
      check(-limit);
    }
  }
}

}  // namespace
}  // namespace morphbus::vm
