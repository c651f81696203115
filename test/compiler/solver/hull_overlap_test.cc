#include "compiler/solver/hull_overlap.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace morphbus::solver {
namespace {

using Eigen::Vector3d;
using model::Pose;
using Points = std::vector<Vector3d>;

Points Box(double x, double y, double z) {
  Points p;
  for (const double sx : {-0.5, 0.5}) {
    for (const double sy : {-0.5, 0.5}) {
      for (const double sz : {-0.5, 0.5}) p.emplace_back(sx * x, sy * y, sz * z);
    }
  }
  return p;
}

Pose At(double x, double y, double z) { return Pose(Eigen::Translation3d(x, y, z)); }

TEST(PenetrationDepth, OfBoxesIsTheLeastOverlapOfTheirSides) {
  const Points box = Box(1, 1, 1);
  EXPECT_DOUBLE_EQ(PenetrationDepth(box, At(0, 0, 0), box, At(0.9, 0.2, 0)), 0.1);
  EXPECT_DOUBLE_EQ(PenetrationDepth(box, At(0, 0, 0), box, At(0, 0, 0)), 1.0);
  EXPECT_EQ(PenetrationDepth(box, At(0, 0, 0), box, At(1, 0.3, 0)), 0.0) << "touching";
  EXPECT_EQ(PenetrationDepth(box, At(0, 0, 0), box, At(2, 0, 0)), 0.0) << "apart";
}

TEST(PenetrationDepth, FindsCrossedEdges) {
  // Two boxes on edge, crossed at right angles: the edges meet along z, faces would say more.
  const Points beam = Box(4, 1, 1);
  const Pose on_edge = At(0, 0, 0) * Eigen::AngleAxisd(M_PI / 4, Vector3d::UnitX());
  const double height = std::sqrt(2.0) - 0.05;
  const Pose crossed = At(0, 0, height) * Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitZ()) *
                       Eigen::AngleAxisd(M_PI / 4, Vector3d::UnitX());
  EXPECT_NEAR(PenetrationDepth(beam, on_edge, beam, crossed), 0.05, 1e-12);
  const Pose above = At(0, 0, 0.06) * crossed;
  EXPECT_EQ(PenetrationDepth(beam, on_edge, beam, above), 0.0);
}

TEST(PenetrationDepth, OfFlatHullsIsHowFarTheyPierce) {
  const Points plate = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  const Points box = Box(1, 1, 1);
  EXPECT_EQ(PenetrationDepth(plate, At(0, 0, 0.5), box, At(0, 0, 0)), 0.0) << "lies in a face";
  EXPECT_NEAR(PenetrationDepth(plate, At(0, 0, 0.3), box, At(0, 0, 0)), 0.2, 1e-12);
  EXPECT_EQ(PenetrationDepth(plate, At(0, 0, 0), plate, At(0.5, 0, 0)), 0.0) << "coplanar";
  const Pose upright = At(0.25, 0, 0) * Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitY());
  EXPECT_NEAR(PenetrationDepth(plate, At(0, 0, 0), plate, upright), 0.75, 1e-12);
}

TEST(PenetrationDepth, OfSegmentsAndPoints) {
  const Points box = Box(1, 1, 1);
  const Points rod = {{0, 0, -2}, {0, 0, 2}};
  EXPECT_NEAR(PenetrationDepth(rod, At(0.2, 0, 0), box, At(0, 0, 0)), 0.3, 1e-12);
  EXPECT_EQ(PenetrationDepth(rod, At(0.5, 0, 0), box, At(0, 0, 0)), 0.0);
  const Pose across = At(0, 0, 0) * Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitX());
  EXPECT_EQ(PenetrationDepth(rod, At(0, 0, 0), rod, across), 0.0);
  EXPECT_NEAR(PenetrationDepth({{0.1, 0, 0}}, At(0, 0, 0), box, At(0, 0, 0)), 0.4, 1e-12);
  EXPECT_EQ(PenetrationDepth({}, At(0, 0, 0), box, At(0, 0, 0)), 0.0);
}

/// The definition by itself: the hull of all differences, and how deep the origin lies in it.
double DepthByMinkowskiDifference(const Points& A, const Points& B) {
  Points difference;
  for (const Vector3d& a : A) {
    for (const Vector3d& b : B) difference.push_back(a - b);
  }
  const model::ConvexHull hull = model::ComputeHull(difference);
  double depth = 1e300;
  for (const model::HullFace& face : hull.faces) depth = std::min(depth, face.offset);
  return std::max(depth, 0.0);
}

TEST(PenetrationDepth, AgreesWithTheMinkowskiDifferenceOnRandomHulls) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  int overlapping = 0;
  for (int round = 0; round < 500; ++round) {
    const auto cloud = [&] {
      Points p(4 + round % 9);
      for (Vector3d& v : p) v = {unit(random), unit(random), unit(random)};
      if (round % 5 == 0) {
        for (Vector3d& v : p) v.z() = 0.25 * v.x();  // flat
      }
      return p;
    };
    const Points A = cloud();
    const Points B = cloud();
    Pose X = At(1.2 * unit(random), unit(random), unit(random));
    X.rotate(
        Eigen::Quaterniond(unit(random), unit(random), unit(random), unit(random)).normalized());
    Points B_moved;
    for (const Vector3d& p : B) B_moved.push_back(X * p);
    const double expected = DepthByMinkowskiDifference(A, B_moved);
    EXPECT_NEAR(PenetrationDepth(A, Pose::Identity(), B, X), expected, 1e-9) << round;
    EXPECT_NEAR(PenetrationDepth(B, X, A, Pose::Identity()), expected, 1e-9) << round;
    double work = 0.0;
    EXPECT_EQ(PenetratesBy(0.05, model::ComputeHull(A), Pose::Identity(), model::ComputeHull(B), X,
                           &work),
              expected > 0.05);
    if (expected > 0.0) ++overlapping;
  }
  EXPECT_GT(overlapping, 100);
  EXPECT_LT(overlapping, 450);
}

}  // namespace
}  // namespace morphbus::solver
