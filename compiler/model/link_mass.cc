#include "compiler/model/link_mass.h"

#include <algorithm>
#include <limits>

#include "compiler/model/convex_hull.h"

namespace morphbus::model {
namespace {

using Eigen::Vector3d;

/// Lighter or thinner links are taken for this much (link_mass.h): physics engines want inertias
/// well above zero.
constexpr double kLeastMass = 1e-3;       // kg
constexpr double kLeastThickness = 1e-3;  // m

/// The points that say where the mass of a link is, part by part: its shape, else what is fixed to
/// it.
std::vector<std::vector<Vector3d>> MassPoints(const ModuleType& type, int link) {
  std::vector<std::vector<Vector3d>> parts = SolidParts(type, link);
  if (!parts.empty()) return parts;
  std::vector<Vector3d> points;
  for (const Connector& connector : type.connectors) {
    if (connector.link == link) points.push_back(connector.p_MoCo_M);
  }
  for (const Joint& joint : type.joints) {
    if (joint.link_a == link || joint.link_b == link) points.push_back(joint.p_MoJo_M);
  }
  if (points.empty()) points.push_back(Vector3d::Zero());
  return {points};
}

/// Smallest distance between two parallel planes that hold the hull between them, over the normals
/// of its faces: exact for prisms, at most a little too wide otherwise.
double Thickness(const ConvexHull& hull) {
  double thickness = std::numeric_limits<double>::infinity();
  for (const HullFace& face : hull.faces) {
    double depth = 0.0;
    for (const Vector3d& vertex : hull.vertices) {
      depth = std::max(depth, face.offset - face.normal.dot(vertex));
    }
    thickness = std::min(thickness, depth);
  }
  return thickness;
}

/// The corners of the box round the points, no side thinner than kLeastThickness.
std::vector<Vector3d> BoundingBox(const std::vector<Vector3d>& points) {
  Eigen::AlignedBox3d box;
  for (const Vector3d& p : points) box.extend(p);
  const Vector3d middle = box.center();
  const Vector3d half = (0.5 * box.sizes()).cwiseMax(Vector3d::Constant(0.5 * kLeastThickness));
  std::vector<Vector3d> corners;
  for (int i = 0; i < 8; ++i) {
    const Vector3d side((i & 1) != 0 ? 1.0 : -1.0, (i & 2) != 0 ? 1.0 : -1.0,
                        (i & 4) != 0 ? 1.0 : -1.0);
    corners.push_back(middle + side.cwiseProduct(half));
  }
  return corners;
}

/// Volume, centroid and inertia of a part for density 1. A simulation needs an inertia that is
/// positive in all directions: hulls that are too thin are taken as boxes.
MassProperties UnitMass(const std::vector<Vector3d>& points) {
  ConvexHull hull = ComputeHull(points);
  if (hull.dimension < 3 || Thickness(hull) < kLeastThickness) {
    hull = ComputeHull(BoundingBox(points));
  }
  return ComputeMassProperties(hull);
}

/// Several bodies of density 1 as one: the parallel axis theorem takes each inertia to the common
/// centroid.
MassProperties Together(const std::vector<MassProperties>& parts) {
  MassProperties sum;
  for (const MassProperties& part : parts) {
    sum.volume += part.volume;
    sum.centroid += part.volume * part.centroid;
  }
  sum.centroid /= sum.volume;
  for (const MassProperties& part : parts) {
    const Vector3d r = part.centroid - sum.centroid;
    sum.inertia += part.inertia + part.volume * (r.squaredNorm() * Eigen::Matrix3d::Identity() -
                                                 r * r.transpose());
  }
  return sum;
}

}  // namespace

LinkMass ComputeLinkMass(const ModuleType& type, int link) {
  std::vector<MassProperties> parts;
  for (const std::vector<Vector3d>& points : MassPoints(type, link)) {
    parts.push_back(UnitMass(points));
  }
  // One part is not summed, so that its numbers stay what they are to the last bit.
  const MassProperties unit = parts.size() == 1 ? parts.front() : Together(parts);
  // The density is uniform, so the inertia of unit density is scaled to the mass.
  LinkMass mass;
  mass.mass_kg = std::max(type.links[link].mass_kg, kLeastMass);
  mass.p_LoLcm_L = unit.centroid;
  mass.I_Lcm_L = unit.inertia * (mass.mass_kg / unit.volume);
  return mass;
}

const LinkMass& LinkMasses::Of(int type, int link) {
  const auto [entry, is_new] = masses_.try_emplace({type, link});
  if (is_new) entry->second = ComputeLinkMass(model_.module_types[type], link);
  return entry->second;
}

std::vector<std::vector<Vector3d>> SolidParts(const ModuleType& type, int link) {
  std::vector<std::vector<Vector3d>> parts = type.links[link].Parts();
  for (std::vector<Vector3d>& points : parts) {
    if (ComputeHull(points).dimension == 3) continue;
    points = ThickenFlat(points, std::max(kFlatThickness * ExtentOf(type), kLeastThickness));
  }
  return parts;
}

}  // namespace morphbus::model
