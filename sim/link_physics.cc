#include "sim/link_physics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "compiler/model/convex_hull.h"

namespace morphbus::sim {
namespace {

using Eigen::Vector3d;

constexpr double kLeastMass = 1e-3;       // kg
constexpr double kLeastThickness = 1e-3;  // m
constexpr double kFlatThickness = 0.05;   // of the module's extent

// The points that say where the mass of a link is: its hull, else what is fixed to it.
std::vector<Vector3d> MassPoints(const model::ModuleType& type, int link) {
  const std::vector<Vector3d>& hull = type.links[static_cast<size_t>(link)].hull;
  if (!hull.empty()) return hull;
  std::vector<Vector3d> points;
  for (const model::Connector& connector : type.connectors) {
    if (connector.link == link) points.push_back(connector.p_MoCo_M);
  }
  for (const model::Joint& joint : type.joints) {
    if (joint.link_a == link || joint.link_b == link) points.push_back(joint.p_MoJo_M);
  }
  if (points.empty()) points.push_back(Vector3d::Zero());
  return points;
}

// Smallest distance between two parallel planes that hold the hull between them, over the normals
// of its faces: exact for prisms, at most a little too wide otherwise.
double Thickness(const model::ConvexHull& hull) {
  double thickness = std::numeric_limits<double>::infinity();
  for (const model::HullFace& face : hull.faces) {
    double depth = 0.0;
    for (const Vector3d& vertex : hull.vertices) {
      depth = std::max(depth, face.offset - face.normal.dot(vertex));
    }
    thickness = std::min(thickness, depth);
  }
  return thickness;
}

std::vector<Vector3d> BoundingBox(const std::vector<Vector3d>& points) {
  Vector3d low = points.front();
  Vector3d high = points.front();
  for (const Vector3d& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const Vector3d middle = 0.5 * (low + high);
  const Vector3d half = (0.5 * (high - low)).cwiseMax(0.5 * kLeastThickness);
  std::vector<Vector3d> corners;
  for (int i = 0; i < 8; ++i) {
    const Vector3d side((i & 1) != 0 ? 1.0 : -1.0, (i & 2) != 0 ? 1.0 : -1.0,
                        (i & 4) != 0 ? 1.0 : -1.0);
    corners.push_back(middle + side.cwiseProduct(half));
  }
  return corners;
}

}  // namespace

std::vector<Vector3d> ShrinkHull(const std::vector<Vector3d>& points, double depth) {
  const model::ConvexHull hull = model::ComputeHull(points);
  if (hull.dimension < 3) return {};
  // Polar duality: with the centroid as origin, the face planes n·x = d are the points n/d, and
  // the corners of the intersection of the half-spaces are the planes of those points' hull.
  const Vector3d centre = model::ComputeMassProperties(hull).centroid;
  double nearest = std::numeric_limits<double>::infinity();
  for (const model::HullFace& face : hull.faces) {
    nearest = std::min(nearest, face.offset - face.normal.dot(centre));
  }
  const double shrink = std::min(depth, 0.5 * nearest);
  std::vector<Vector3d> dual;
  for (const model::HullFace& face : hull.faces) {
    dual.push_back(face.normal / (face.offset - face.normal.dot(centre) - shrink));
  }
  std::vector<Vector3d> corners;
  for (const model::HullFace& face : model::ComputeHull(dual).faces) {
    corners.push_back(centre + face.normal / face.offset);
  }
  return corners;
}

LinkPhysics ComputeLinkPhysics(const model::ModuleType& type, int link) {
  const std::vector<Vector3d> points = MassPoints(type, link);
  model::ConvexHull hull = model::ComputeHull(points);
  LinkPhysics physics;
  if (!type.links[static_cast<size_t>(link)].hull.empty()) {
    const double thickness = std::max(kFlatThickness * model::ExtentOf(type), kLeastThickness);
    physics.core_L = ShrinkHull(hull.dimension < 3 ? model::ThickenFlat(points, thickness) : points,
                                kHullShrink + kCollisionMargin);
  }
  if (hull.dimension < 3 || Thickness(hull) < kLeastThickness) {
    hull = model::ComputeHull(BoundingBox(points));
  }
  const model::MassProperties unit = model::ComputeMassProperties(hull);
  physics.mass_kg = std::max(type.links[static_cast<size_t>(link)].mass_kg, kLeastMass);
  physics.p_LoLcm_L = unit.centroid;
  physics.I_Lcm_L = unit.inertia * (physics.mass_kg / unit.volume);
  return physics;
}

}  // namespace morphbus::sim
