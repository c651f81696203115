#include "sim/link_physics.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "test/sim/mtran.h"
#include "test/sim/toy_robots.h"

namespace morphbus::sim {
namespace {

using Eigen::Vector3d;

model::ModuleType OneLink(const std::vector<Vector3d>& hull, double mass_kg) {
  model::ModuleType type;
  type.links.push_back({"link", hull, {}, mass_kg});
  return type;
}

// Moments of inertia of a solid box with sides a, b, c.
Vector3d BoxMoments(double mass, double a, double b, double c) {
  return mass / 12.0 * Vector3d(b * b + c * c, a * a + c * c, a * a + b * b);
}

TEST(LinkPhysicsTest, ASolidLinkHasTheInertiaOfItsHull) {
  const LinkPhysics link =
      ComputeLinkPhysics(OneLink(test::BoxCorners({0, 0, 0}, {0.1, 0.2, 0.3}), 2.0), 0);
  EXPECT_NEAR((link.p_LoLcm_L - Vector3d(0.05, 0.1, 0.15)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((link.I_Lcm_L.diagonal() - BoxMoments(2.0, 0.1, 0.2, 0.3)).norm(), 0.0, 1e-12);
  EXPECT_EQ(link.mass_kg, 2.0);
}

/// A rhombus in the box 0.2 x 0.1.
const std::vector<Vector3d> kRhombus = {{0.1, 0, 0}, {-0.1, 0, 0}, {0, 0.05, 0}, {0, -0.05, 0}};

TEST(LinkPhysicsTest, AFlatLinkHasTheInertiaOfItsHullThickenedByATwentiethOfTheExtent) {
  const LinkPhysics link = ComputeLinkPhysics(OneLink(kRhombus, 0.5), 0);
  // A prism 0.01 thick; the second moments of a rhombus are a sixth of its half diagonals' squares.
  const double x = 0.1 * 0.1 / 6;
  const double y = 0.05 * 0.05 / 6;
  const double z = 0.01 * 0.01 / 12;
  EXPECT_NEAR((link.I_Lcm_L.diagonal() - 0.5 * Vector3d(y + z, x + z, x + y)).norm(), 0.0, 1e-10);
}

TEST(LinkPhysicsTest, AThinLinkHasTheInertiaOfItsBoundingBoxOneMillimetreThick) {
  std::vector<Vector3d> thin;
  for (const Vector3d& p : kRhombus) {
    thin.push_back(p + Vector3d(0, 0, 0.0002));
    thin.push_back(p - Vector3d(0, 0, 0.0002));
  }
  const LinkPhysics link = ComputeLinkPhysics(OneLink(thin, 0.5), 0);
  EXPECT_NEAR((link.I_Lcm_L.diagonal() - BoxMoments(0.5, 0.2, 0.1, 0.001)).norm(), 0.0, 1e-10);
}

TEST(LinkPhysicsTest, NoLinkWeighsUnderOneGram) {
  EXPECT_EQ(
      ComputeLinkPhysics(OneLink(test::BoxCorners({0, 0, 0}, {0.1, 0.1, 0.1}), 0.0), 0).mass_kg,
      0.001);
}

TEST(LinkPhysicsTest, ALinkWithoutHullHasMassButNothingToCollideWith) {
  const LinkPhysics link = ComputeLinkPhysics(OneLink({}, 0.1), 0);
  EXPECT_TRUE(link.cores_L.empty());
  EXPECT_GT(link.I_Lcm_L.diagonal().minCoeff(), 0.0);
}

TEST(LinkPhysicsTest, MtranBlockHasTheMassPropertiesOfAHalfPrism) {
  // Half cube (x from -2 to -1) and a wedge down to the edge x = 0: volumes 4 and 2 unit³,
  // centroids at -1.5 and -2/3.
  const auto model = test::MtranModel();
  const LinkPhysics block = ComputeLinkPhysics(model->module_types[0], 0);
  const double centroid = 0.0325 * (4.0 * -1.5 + 2.0 * (-2.0 / 3.0)) / 6.0;
  EXPECT_NEAR((block.p_LoLcm_L - Vector3d(centroid, 0, 0)).norm(), 0.0, 1e-12);
}

TEST(LinkPhysicsTest, AShrunkCubeIsSmallerOnEverySide) {
  const std::vector<Vector3d> core = ShrinkHull(test::BoxCorners({0, 0, 0}, {0.1, 0.2, 0.3}), 0.01);
  ASSERT_EQ(core.size(), 8u);
  for (const Vector3d& want : test::BoxCorners({0.01, 0.01, 0.01}, {0.09, 0.19, 0.29})) {
    const bool found = std::any_of(
        core.begin(), core.end(), [&want](const Vector3d& p) { return (p - want).norm() < 1e-12; });
    EXPECT_TRUE(found) << want.transpose();
  }
}

TEST(LinkPhysicsTest, ThinHullsShrinkByAtMostHalf) {
  const std::vector<Vector3d> core =
      ShrinkHull(test::BoxCorners({0, 0, 0}, {0.1, 0.1, 0.004}), 0.01);
  ASSERT_EQ(core.size(), 8u);
  for (const Vector3d& p : core) EXPECT_NEAR(std::abs(p.z() - 0.002), 0.001, 1e-12);
}

TEST(LinkPhysicsTest, FlatHullsCannotShrink) {
  EXPECT_TRUE(ShrinkHull({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, 0.001).empty());
  EXPECT_TRUE(ShrinkHull({}, 0.001).empty());
}

TEST(LinkPhysicsTest, AFlatHullIsThickenedForCollisions) {
  const auto model = test::MtranModel();
  const LinkPhysics bar = ComputeLinkPhysics(model->module_types[0], 2);
  ASSERT_EQ(bar.cores_L.size(), 1u);
  double depth = 0.0;
  for (const Vector3d& p : bar.cores_L.front()) depth = std::max(depth, p.z());
  // 0.05 of 4 units, half of it on either side, less the shrinking.
  EXPECT_NEAR(depth, 0.0325 * 0.1 - kHullShrink - kCollisionMargin, 1e-9);
}

}  // namespace
}  // namespace morphbus::sim
