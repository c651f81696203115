#include "sim/link_physics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "compiler/model/convex_hull.h"
#include "compiler/model/link_mass.h"

namespace morphbus::sim {

using Eigen::Vector3d;

// Moving the faces inwards can swallow corners and edges, so the corners are found anew.
std::vector<Vector3d> ShrinkHull(const std::vector<Vector3d>& points, double depth) {
  const model::ConvexHull hull = model::ComputeHull(points);
  if (hull.dimension < 3) return {};
  // Polar duality: with the centroid as origin, the face planes n·x = d are the points n/d, and
  // the corners of the intersection of the half-spaces are the planes of those points' hull.
  const Vector3d centre = model::ComputeMassProperties(hull).centroid;
  // A hull thinner than twice the depth would turn inside out: it shrinks by half of its least
  // radius.
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
  const model::LinkMass mass = model::ComputeLinkMass(type, link);
  LinkPhysics physics;
  physics.mass_kg = mass.mass_kg;
  physics.p_LoLcm_L = mass.p_LoLcm_L;
  physics.I_Lcm_L = mass.I_Lcm_L;
  physics.friction = type.links[link].friction;
  // The engine adds its own margin round the hull, so the hull is smaller by that too.
  for (const std::vector<Vector3d>& solid : model::SolidParts(type, link)) {
    physics.cores_L.push_back(ShrinkHull(solid, kHullShrink + kCollisionMargin));
  }
  return physics;
}

LinkPhysicsTable ComputeLinkPhysics(const model::Model& model, const model::Robot& robot) {
  LinkPhysicsTable table(model.module_types.size());
  for (const model::ModuleInstance& module : robot.modules) {
    // Modules of one type are alike.
    std::vector<LinkPhysics>& links = table[module.type];
    if (!links.empty()) continue;
    const model::ModuleType& type = model.module_types[module.type];
    for (int l = 0; l < std::ssize(type.links); ++l) links.push_back(ComputeLinkPhysics(type, l));
  }
  return table;
}

}  // namespace morphbus::sim
