#include "compiler/solver/motion_postures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace morphbus::solver {
namespace {

using model::Joint;
using model::JointType;

Joint Limited(double lower, double upper) {
  Joint joint;
  joint.lower = lower;
  joint.upper = upper;
  return joint;
}

TEST(PostureValues, BeginsWithAllCornersOfAFewRangesEachOnce) {
  const Joint a = Limited(-1.0, 2.0);
  const Joint b = Limited(0.1, 0.3);
  const Joint c = Limited(-5.0, -4.0);
  std::set<std::vector<double>> corners;
  for (int posture = 1; posture <= 8; ++posture) {
    const std::vector<double> values = PostureValues({&a, &b, &c}, 1, posture);
    EXPECT_TRUE(values[0] == -1.0 || values[0] == 2.0);
    EXPECT_TRUE(values[1] == 0.1 || values[1] == 0.3);
    EXPECT_TRUE(values[2] == -5.0 || values[2] == -4.0);
    corners.insert(values);
  }
  EXPECT_EQ(corners.size(), 8u);
  EXPECT_EQ(PostureValues({&a, &b, &c}, 1, 1), (std::vector<double>{-1.0, 0.1, -5.0}));
  EXPECT_EQ(PostureValues({&a, &b, &c}, 1, 2), (std::vector<double>{2.0, 0.3, -4.0}));
  // Behind the corners every seed has postures of its own.
  EXPECT_NE(PostureValues({&a, &b, &c}, 1, 9), PostureValues({&a, &b, &c}, 2, 9));
}

TEST(PostureValues, TriesOnlyTheEqualCornersOfManyRanges) {
  const Joint joint = Limited(-1.0, 1.0);
  const std::vector<const Joint*> joints(9, &joint);
  EXPECT_EQ(PostureValues(joints, 1, 1), std::vector<double>(9, -1.0));
  EXPECT_EQ(PostureValues(joints, 1, 2), std::vector<double>(9, 1.0));
  const std::vector<double> third = PostureValues(joints, 1, 3);
  EXPECT_TRUE(std::all_of(third.begin(), third.end(), [](double q) { return std::abs(q) < 1.0; }));
}

TEST(PostureValues, AreWithinTheLimitsAndAtThemInEveryOtherOne) {
  const Joint joint = Limited(0.1, 0.7);
  int lower = 0;
  int upper = 0;
  int upper_half = 0;
  constexpr int kPostures = 4000;
  for (int posture = 100; posture < 100 + kPostures; ++posture) {
    const double value = PostureValues({&joint}, 5, posture)[0];
    EXPECT_GE(value, 0.1);
    EXPECT_LE(value, 0.7);
    const bool at_limit = value == 0.1 || value == 0.7;
    EXPECT_TRUE(!at_limit || posture % 2 == 0);
    lower += value == 0.1 ? 1 : 0;
    upper += value == 0.7 ? 1 : 0;
    upper_half += value > 0.4 ? 1 : 0;
  }
  // Shares of an eighth, an eighth and a half, to more than five deviations.
  EXPECT_NEAR(lower, kPostures / 8, 120);
  EXPECT_NEAR(upper, kPostures / 8, 120);
  EXPECT_NEAR(upper_half, kPostures / 2, 180);
}

TEST(PostureValues, GoRoundWhereThereAreNoLimits) {
  Joint joint =
      Limited(-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity());
  joint.type = JointType::kContinuous;
  const Joint limited = Limited(0.0, 1.0);
  double least = 0.0;
  double most = 0.0;
  for (int posture = 5; posture < 2000; ++posture) {
    const double value = PostureValues({&joint, &limited}, 1, posture)[0];
    EXPECT_LT(std::abs(value), M_PI) << "the ends of the turn are one posture";
    least = std::min(least, value);
    most = std::max(most, value);
  }
  EXPECT_LT(least, -3.1);
  EXPECT_GT(most, 3.1);
}

}  // namespace
}  // namespace morphbus::solver
