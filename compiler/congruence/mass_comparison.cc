#include "compiler/congruence/mass_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "compiler/congruence/classes.h"
#include "compiler/model/convex_hull.h"
#include "compiler/model/link_mass.h"

namespace morphbus::congruence {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A link's mass distribution and the corners of its hull, in its module's frame.
struct LinkShape {
  double mass_kg = 0.0;
  Vector3d centre;
  Matrix3d inertia;               ///< About the centre (kg m²).
  std::vector<Vector3d> corners;  ///< None if the link has no hull.
};

/// Works out the shape of one link of a module type.
LinkShape ShapeOf(const model::ModuleType& type, int link) {
  const model::LinkMass mass = model::ComputeLinkMass(type, link);
  return {mass.mass_kg, mass.p_LoLcm_L, mass.I_Lcm_L,
          model::ComputeHull(type.links[link].hull).vertices};
}

/// Makes the shapes of bodies; works out the links of each module type once.
class Shapes {
 public:
  explicit Shapes(const ScrewGraph& graph) : graph_(graph) {}

  BodyShape Of(int body) {
    // Moments about the reference point add up over the links (parallel axis theorem).
    BodyShape shape;
    for (const model::LinkRef& ref : graph_.bodies[body].links) {
      const LinkShape& link = Link(graph_.robot->modules[ref.module].type, ref.link);
      model::Pose X_TL = graph_.X_RL[ref.module][ref.link];
      X_TL.translation() -= graph_.bodies[body].p_RoTo;
      const Vector3d centre = X_TL * link.centre;
      shape.mass_kg += link.mass_kg;
      shape.moment += link.mass_kg * centre;
      shape.inertia += X_TL.linear() * link.inertia * X_TL.linear().transpose() +
                       link.mass_kg * (centre.squaredNorm() * Matrix3d::Identity() -
                                       centre * centre.transpose());
      if (link.corners.empty()) continue;
      std::vector<Vector3d>& hull = shape.hulls.emplace_back();
      for (const Vector3d& p : link.corners) hull.push_back(X_TL * p);
    }
    return shape;
  }

 private:
  const LinkShape& Link(int type, int link) {
    // All links of a type at once, when the first is asked for.
    std::vector<LinkShape>& shapes = shapes_[type];
    if (shapes.empty()) {
      const model::ModuleType& module = graph_.model->module_types[type];
      for (size_t l = 0; l < module.links.size(); ++l) {
        shapes.push_back(ShapeOf(module, static_cast<int>(l)));
      }
    }
    return shapes[link];
  }

  const ScrewGraph& graph_;
  std::map<int, std::vector<LinkShape>> shapes_;  ///< By module type.
};

/// The mean of the points.
Vector3d MiddleOf(const std::vector<Vector3d>& points) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

/// Has each point of a one of b within `tolerance` (m), and are they as many?
bool SamePoints(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b, double tolerance) {
  if (a.size() != b.size()) return false;
  return std::all_of(a.begin(), a.end(), [&](const Vector3d& p) {
    return std::any_of(b.begin(), b.end(),
                       [&](const Vector3d& q) { return (p - q).norm() <= tolerance; });
  });
}

/// Can each hull of a, turned by R, be paired with one of b? Candidates are looked up by the x of
/// their middles, so that bodies of many links are quick.
bool SameHulls(const BodyShape& a, const BodyShape& b, const Matrix3d& R, double tolerance) {
  if (a.hulls.size() != b.hulls.size()) return false;
  // The hulls of b in order of x.
  std::vector<std::pair<double, size_t>> by_x;
  for (size_t i = 0; i < b.hulls.size(); ++i) by_x.emplace_back(MiddleOf(b.hulls[i]).x(), i);
  std::sort(by_x.begin(), by_x.end());
  std::vector<bool> taken(b.hulls.size(), false);
  // For each of a, turned, the first of those near its x that is the same and not taken yet.
  for (std::vector<Vector3d> hull : a.hulls) {
    for (Vector3d& p : hull) p = R * p;
    const Vector3d middle = MiddleOf(hull);
    bool found = false;
    auto it =
        std::lower_bound(by_x.begin(), by_x.end(), std::pair(middle.x() - tolerance, size_t{0}));
    for (; it != by_x.end() && it->first <= middle.x() + tolerance && !found; ++it) {
      if (taken[it->second] || !SamePoints(hull, b.hulls[it->second], tolerance)) continue;
      taken[it->second] = found = true;
    }
    if (!found) return false;
  }
  return true;
}

}  // namespace

MassComparer::MassComparer(const ScrewGraph& a, const ScrewGraph& b) : a_(a), b_(b) {
  Shapes shapes_a(a);
  Shapes shapes_b(b);
  for (size_t i = 0; i < a.bodies.size(); ++i) of_a_.push_back(shapes_a.Of(static_cast<int>(i)));
  for (size_t i = 0; i < b.bodies.size(); ++i) of_b_.push_back(shapes_b.Of(static_cast<int>(i)));
}

MassComparison MassComparer::Compare(const Mapping& mapping) const {
  MassComparison result;
  const double extent = std::max(a_.extent_m, b_.extent_m);
  for (size_t i = 0; i < a_.bodies.size(); ++i) {
    const int body = static_cast<int>(i);
    const int image = mapping.body_to[i];
    // Lengths are compared to a part of the assemblies' extent and the body's own.
    const BodyShape& from = of_a_[i];
    const BodyShape& to = of_b_[image];
    const Matrix3d& R = mapping.R[i];
    const double mass = std::max(from.mass_kg, to.mass_kg);
    const double length = extent + std::sqrt(std::max(from.inertia.trace(), to.inertia.trace()) /
                                             std::max(mass, 1e-12));
    // Of masses, moments (times a length) and inertias (times its square) the same part.
    const double tolerance = kGeometryTolerance * mass;

    // Only the first difference is told.
    const auto pair = [&] {
      return fmt::format("{} and {}", a_.BodyName(body), b_.BodyName(image));
    };
    if (result.masses_equal && std::abs(from.mass_kg - to.mass_kg) > tolerance) {
      result.masses_equal = false;
      result.mass_difference =
          fmt::format("{} weigh {:.6g} and {:.6g} kg", pair(), from.mass_kg, to.mass_kg);
    } else if (result.masses_equal && (R * from.moment - to.moment).norm() > tolerance * length) {
      result.masses_equal = false;
      result.mass_difference = fmt::format("the centres of mass of {} are {:.3g} m apart", pair(),
                                           (R * from.moment - to.moment).norm() / mass);
    } else if (result.masses_equal && (R * from.inertia * R.transpose() - to.inertia).norm() >
                                          tolerance * length * length) {
      result.masses_equal = false;
      result.mass_difference = fmt::format("{} have different moments of inertia", pair());
    }
    if (result.hulls_equal && !SameHulls(from, to, R, kGeometryTolerance * extent)) {
      result.hulls_equal = false;
      result.hull_difference = fmt::format("{} have different hulls", pair());
    }
  }
  return result;
}

}  // namespace morphbus::congruence
