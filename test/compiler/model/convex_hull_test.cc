#include "compiler/model/convex_hull.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

namespace morphbus::model {
namespace {

using Eigen::Vector3d;
using Points = std::vector<Vector3d>;

Points Box(double x, double y, double z) {
  Points p;
  for (const double sx : {0.0, 1.0}) {
    for (const double sy : {0.0, 1.0}) {
      for (const double sz : {0.0, 1.0}) p.emplace_back(sx * x, sy * y, sz * z);
    }
  }
  return p;
}

/// Euler's formula, outward planes, and every point below every plane.
void ExpectSoundSolid(const ConvexHull& hull, const Points& points, double tolerance) {
  ASSERT_EQ(hull.dimension, 3);
  EXPECT_EQ(hull.vertices.size() + hull.faces.size(), hull.edges.size() + 2);
  for (const HullFace& face : hull.faces) {
    EXPECT_NEAR(face.normal.norm(), 1.0, 1e-12);
    for (const Vector3d& p : points) EXPECT_LE(face.normal.dot(p), face.offset + tolerance);
  }
}

TEST(ConvexHull, OfABoxHasSixQuadsAndTwelveEdges) {
  Points points = Box(1, 2, 3);
  points.emplace_back(0.5, 1, 1.5);  // inside
  points.emplace_back(0.5, 1, 0);    // in a face
  points.emplace_back(0.5, 0, 0);    // on an edge
  points.emplace_back(1, 2, 3);      // twice
  const ConvexHull hull = ComputeHull(points);
  ExpectSoundSolid(hull, points, 1e-12);
  EXPECT_EQ(hull.vertices.size(), 8u);
  EXPECT_EQ(hull.faces.size(), 6u);
  EXPECT_EQ(hull.edges.size(), 12u);
  EXPECT_EQ(hull.triangles.size(), 12u);
  EXPECT_DOUBLE_EQ(HullVolume(points), 6.0);
}

TEST(ConvexHull, OfFlatCollinearAndSinglePointsKeepsTheirDimension) {
  const ConvexHull flat = ComputeHull({{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}, {0.5, 0.5, 1}});
  EXPECT_EQ(flat.dimension, 2);
  EXPECT_EQ(flat.vertices.size(), 4u);
  EXPECT_EQ(flat.faces.size(), 2u);
  const ConvexHull line = ComputeHull({{0, 0, 0}, {1, 1, 1}, {0.5, 0.5, 0.5}});
  EXPECT_EQ(line.dimension, 1);
  EXPECT_EQ(line.vertices.size(), 2u);
  EXPECT_EQ(ComputeHull({{1, 2, 3}, {1, 2, 3}}).dimension, 0);
  EXPECT_EQ(ComputeHull({}).dimension, -1);
  EXPECT_EQ(HullVolume({{0, 0, 1}, {1, 0, 1}, {1, 1, 1}}), 0.0);
}

TEST(ConvexHull, SurvivesPointsOnASphereAndOnAGrid) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  Points sphere(400);
  for (Vector3d& p : sphere)
    p = Vector3d(normal(random), normal(random), normal(random)).normalized();
  const ConvexHull round = ComputeHull(sphere);
  EXPECT_EQ(round.vertices.size(), 400u);
  ExpectSoundSolid(round, sphere, 1e-9);
  Points grid;
  for (int x = 0; x < 6; ++x) {
    for (int y = 0; y < 6; ++y) {
      for (int z = 0; z < 6; ++z) grid.emplace_back(0.1 * x, 0.1 * y, 0.1 * z);
    }
  }
  const ConvexHull cube = ComputeHull(grid);
  ExpectSoundSolid(cube, grid, 1e-9);
  EXPECT_EQ(cube.vertices.size(), 8u);
  EXPECT_NEAR(HullVolume(grid), 0.125, 1e-12);
}

TEST(ConvexHull, SurvivesTurnedGridsAndNearlyFlatSlabs) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int round = 0; round < 200; ++round) {
    const Eigen::Quaterniond R =
        Eigen::Quaterniond(unit(random), unit(random), unit(random), unit(random)).normalized();
    Points points;
    const double thickness = std::pow(10.0, -round % 8);
    for (int x = 0; x < 4; ++x) {
      for (int y = 0; y < 4; ++y) {
        for (int z = 0; z < 2; ++z) points.push_back(R * Vector3d(x, y, thickness * z));
      }
    }
    const ConvexHull hull = ComputeHull(points);
    ExpectSoundSolid(hull, points, 1e-8);
    EXPECT_NEAR(HullVolume(points), 9.0 * thickness, 1e-7);
  }
}

TEST(MassProperties, OfABoxAreTheTextbooks) {
  const MassProperties box = ComputeMassProperties(ComputeHull(Box(1, 2, 3)));
  EXPECT_NEAR(box.volume, 6.0, 1e-12);
  EXPECT_LT((box.centroid - Vector3d(0.5, 1, 1.5)).norm(), 1e-12);
  const Vector3d expected(6.0 * (4 + 9) / 12, 6.0 * (1 + 9) / 12, 6.0 * (1 + 4) / 12);
  EXPECT_LT((box.inertia - Eigen::Matrix3d(expected.asDiagonal())).norm(), 1e-12);
}

TEST(MassProperties, OfATetrahedronAgreeWithSampling) {
  const Points corners = {{0, 0, 0}, {1, 0, 0}, {0.2, 1, 0}, {0.1, 0.3, 0.9}};
  const MassProperties exact = ComputeMassProperties(ComputeHull(corners));
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const ConvexHull hull = ComputeHull(corners);
  int inside = 0;
  Vector3d sum = Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  const int samples = 200000;
  for (int i = 0; i < samples; ++i) {
    const Vector3d p(unit(random), unit(random), unit(random));
    bool in = true;
    for (const HullFace& face : hull.faces) in = in && face.normal.dot(p) <= face.offset;
    if (!in) continue;
    ++inside;
    sum += p;
    const Vector3d arm = p - exact.centroid;
    second += arm * arm.transpose() / samples;
  }
  EXPECT_NEAR(exact.volume, static_cast<double>(inside) / samples, 0.005);
  EXPECT_LT((exact.centroid - sum / inside).norm(), 0.005);
  const Eigen::Matrix3d inertia = second.trace() * Eigen::Matrix3d::Identity() - second;
  EXPECT_LT((exact.inertia - inertia).norm(), 0.001);
}

TEST(ThickenFlat, GivesFlatHullsTheThicknessAskedFor) {
  EXPECT_NEAR(HullVolume(ThickenFlat({{0, 0, 1}, {2, 0, 1}, {2, 1, 1}, {0, 1, 1}}, 0.1)), 0.2,
              1e-12);
  EXPECT_NEAR(HullVolume(ThickenFlat({{0, 0, 0}, {2, 0, 0}}, 0.1)), 0.02, 1e-12);
  EXPECT_NEAR(HullVolume(ThickenFlat({{1, 1, 1}}, 0.1)), 0.001, 1e-12);
  EXPECT_NEAR(HullVolume(ThickenFlat(Box(1, 1, 1), 0.1)), 1.0, 1e-12);
  EXPECT_TRUE(ThickenFlat({}, 0.1).empty());
}

}  // namespace
}  // namespace morphbus::model
