#include "compiler/congruence/partial_rotations.h"

#include <gtest/gtest.h>

#include <cmath>

namespace morphbus::congruence {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

const Vector3d kX(1, 0, 0), kY(0, 1, 0), kZ(0, 0, 1);

TEST(PartialRotations, AVectorOffTheAxisSettlesTheTurn) {
  PartialRotations R(1, {});
  R.SetUpToTurn(0, Matrix3d::Identity(), kZ);
  EXPECT_FALSE(R.settled(0));
  EXPECT_TRUE(R.AlignDirection(0, kZ, kZ)) << "the axis itself tells nothing";
  EXPECT_FALSE(R.settled(0));
  EXPECT_FALSE(R.AlignDirection(0, kX, kZ));
  const PartialRotations::Mark before = R.mark();
  EXPECT_TRUE(R.AlignDirection(0, kX, kY));
  EXPECT_TRUE(R.settled(0));
  EXPECT_LT((R.Value(0) - Turn(kZ, M_PI / 2)).norm(), 1e-12);
  EXPECT_FALSE(R.AlignDirection(0, kX, -kY));
  R.Undo(before);
  EXPECT_FALSE(R.settled(0));
  EXPECT_TRUE(R.AlignDirection(0, kX, -kY));
}

TEST(PartialRotations, BodiesOfAGroupTurnTogetherWhicheverWayTheirAxesPoint) {
  PartialRotations R(3, {});
  R.SetUpToTurn(0, Turn(kZ, 0.1), kZ);
  R.SetUpToTurn(1, Turn(kZ, 0.2), -kZ);
  R.SetUpToTurn(2, Turn(kZ, -0.7), kZ);
  EXPECT_TRUE(R.Relate(0, 1, kZ, 0.5));    // R1 = Rot(0.5) R0
  EXPECT_TRUE(R.Relate(2, 1, kZ, -0.25));  // R1 = Rot(-0.25) R2
  EXPECT_TRUE(R.Relate(0, 2, kZ, 0.75)) << "which follows";
  EXPECT_FALSE(R.Relate(0, 2, kZ, 0.8));
  EXPECT_EQ(R.GroupOf(0), R.GroupOf(2));
  EXPECT_TRUE(R.AlignDirection(2, kX, kX));
  EXPECT_LT((R.Value(2) - Matrix3d::Identity()).norm(), 1e-12);
  EXPECT_LT((R.Value(1) - Turn(kZ, -0.25)).norm(), 1e-12);
  EXPECT_LT((R.Value(0) - Turn(kZ, -0.75)).norm(), 1e-12);
}

TEST(PartialRotations, ASettledBodySettlesThoseRelatedToIt) {
  PartialRotations R(3, {});
  R.SetUpToTurn(0, Matrix3d::Identity(), kX);
  R.SetUpToTurn(1, Matrix3d::Identity(), -kX);
  EXPECT_TRUE(R.Relate(0, 1, kX, 0.0));
  R.SetWhole(2, Turn(kX, 1.0));
  EXPECT_TRUE(R.Relate(1, 2, kX, 0.25));
  EXPECT_LT((R.Value(0) - Turn(kX, 0.75)).norm(), 1e-12);
  EXPECT_LT((R.Value(1) - Turn(kX, 0.75)).norm(), 1e-12);
  R.SetWhole(0, Turn(kY, 1.0));
  EXPECT_FALSE(R.Relate(0, 2, kX, 0.0));
}

TEST(PartialRotations, TwoVectorsAndTheirImagesDetermineARotation) {
  const Matrix3d R = RotationFrom(kX, kY, kZ, kX);
  EXPECT_LT((R * kX - kZ).norm(), 1e-15);
  EXPECT_LT((R * kY - kX).norm(), 1e-15);
  EXPECT_NEAR(R.determinant(), 1.0, 1e-15);
}

}  // namespace
}  // namespace morphbus::congruence
