#include "sim/engine_limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>
#include <vector>

#include "compiler/model/convex_hull.h"
#include "compiler/model/link_mass.h"
#include "sim/link_physics.h"

namespace morphbus::sim {
namespace {

using Eigen::Vector3d;

// The smallest and the largest distance of parallel planes, each along a face's normal or between
// corners, that hold the hull between them (m).
struct Extents {
  double thickness = std::numeric_limits<double>::infinity();
  double length = 0.0;
};

Extents ExtentsOf(const model::ConvexHull& hull) {
  Extents extents;
  // The smallest distance is that along a face's normal: a plane on a face, and the parallel one
  // through the farthest corner. Where two edges face each other it may be smaller still; then this
  // is an upper bound.
  for (const model::HullFace& face : hull.faces) {
    double depth = 0.0;
    for (const Vector3d& p : hull.vertices) {
      depth = std::max(depth, face.offset - face.normal.dot(p));
    }
    extents.thickness = std::min(extents.thickness, depth);
  }
  for (const Vector3d& p : hull.vertices) {
    for (const Vector3d& q : hull.vertices) {
      extents.length = std::max(extents.length, (p - q).norm());
    }
  }
  return extents;
}

// A length for people: "4e-08 m".
std::string Metres(double x) { return fmt::format("{:.3g} m", x); }

// Why the engine cannot have the link; empty if it can.
std::string WhyUnbearable(const model::ModuleType& type, int link) {
  // Flat parts are thickened, so that the widest is looked for in the shape as it was declared.
  double length = 0.0;
  for (const std::vector<Vector3d>& part : type.links[link].Parts()) {
    length = std::max(length, ExtentsOf(model::ComputeHull(part)).length);
  }
  const std::vector<std::vector<Vector3d>> solids = model::SolidParts(type, link);
  if (!solids.empty() && length < kLeastLinkExtent) {
    return fmt::format("is {} across, and the simulation needs {} at least", Metres(length),
                       Metres(kLeastLinkExtent));
  }
  for (const std::vector<Vector3d>& solid : solids) {
    const Extents extents = ExtentsOf(model::ComputeHull(solid));
    if (extents.thickness < kLeastPartThickness) {
      return fmt::format("has a part {} thick, and the simulation needs {} at least",
                         Metres(extents.thickness), Metres(kLeastPartThickness));
    }
    // What is left for the engine must still be a solid; of splinters nothing is.
    const std::vector<Vector3d> core = ShrinkHull(solid, kHullShrink + kCollisionMargin);
    if (model::ComputeHull(core).dimension < 3) {
      return fmt::format(
          "has a part {} long and {} thick, which is too slender to be simulated: "
          "at most 5000 times as long as thick",
          Metres(extents.length), Metres(extents.thickness));
    }
  }
  return {};
}

}  // namespace

Result<void> CheckShapes(const model::Model& model, const model::Robot& robot) {
  // Each module type is looked at once, however many modules are of it.
  std::set<int> types;
  for (const model::ModuleInstance& module : robot.modules) types.insert(module.type);
  for (const int t : types) {
    const model::ModuleType& type = model.module_types[t];
    for (int l = 0; l < static_cast<int>(type.links.size()); ++l) {
      const std::string why = WhyUnbearable(type, l);
      if (why.empty()) continue;
      return Fail(
          fmt::format("link {} of {} {}; change its 'hull=', or 'unit=' of the module (a model "
                      "unit is {} here)",
                      type.links[l].name, type.name, why, Metres(type.unit_m)));
    }
  }
  return {};
}

Result<void> CheckReach(const model::Model& model, const model::Robot& robot,
                        const RigidBodyModel& rigid_bodies) {
  for (const BodySpec& body : rigid_bodies.bodies) {
    for (const LinkSpec& link : body.links) {
      for (const std::vector<Vector3d>& part : link.parts_B) {
        // Distances are from Bo, the body's centre of mass, round which the engine turns the body.
        for (const Vector3d& p : part) {
          // What is not a number fails the comparison, too.
          if (p.norm() <= kMostBodyReach) continue;
          const model::ModuleType& type = model.TypeOf(robot, link.ref.module);
          return Fail(fmt::format(
              "link {} of {} reaches {} from its body's centre of mass, and the simulation bears "
              "{} at most; change its 'hull=', or 'unit=' of the module (a model unit is {} here)",
              type.links[link.ref.link].name, robot.modules[link.ref.module].name, Metres(p.norm()),
              Metres(kMostBodyReach), Metres(type.unit_m)));
        }
      }
    }
  }
  return {};
}

}  // namespace morphbus::sim
