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
  Matrix3d inertia;  ///< About the centre (kg m²).
  std::vector<Vector3d> corners;
};

LinkShape ShapeOf(const model::ModuleType& type, int link) {
  const model::LinkMass mass = model::ComputeLinkMass(type, link);
  return {mass.mass_kg, mass.p_LoLcm_L, mass.I_Lcm_L,
          model::ComputeHull(type.links[static_cast<size_t>(link)].hull).vertices};
}

class Shapes {
 public:
  explicit Shapes(const Assembly& assembly) : assembly_(assembly) {}

  BodyShape Of(int body) {
    BodyShape shape;
    for (const model::LinkRef& ref : assembly_.bodies[body].links) {
      const LinkShape& link = Link(assembly_.robot->modules[ref.module].type, ref.link);
      model::Pose X_TL = assembly_.X_RL[ref.module][ref.link];
      X_TL.translation() -= assembly_.bodies[body].p_RoTo;
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
    std::vector<LinkShape>& shapes = shapes_[type];
    if (shapes.empty()) {
      const model::ModuleType& module = assembly_.model->module_types[type];
      for (size_t l = 0; l < module.links.size(); ++l) {
        shapes.push_back(ShapeOf(module, static_cast<int>(l)));
      }
    }
    return shapes[link];
  }

  const Assembly& assembly_;
  std::map<int, std::vector<LinkShape>> shapes_;
};

Vector3d MiddleOf(const std::vector<Vector3d>& points) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

bool SamePoints(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b, double tolerance) {
  if (a.size() != b.size()) return false;
  return std::all_of(a.begin(), a.end(), [&](const Vector3d& p) {
    return std::any_of(b.begin(), b.end(),
                       [&](const Vector3d& q) { return (p - q).norm() <= tolerance; });
  });
}

/// Pairs each hull of a, turned by R, with one of b; sorted by place, so that large bodies are
/// quick.
bool SameHulls(const BodyShape& a, const BodyShape& b, const Matrix3d& R, double tolerance) {
  if (a.hulls.size() != b.hulls.size()) return false;
  std::vector<std::pair<double, size_t>> by_x;
  for (size_t i = 0; i < b.hulls.size(); ++i) by_x.emplace_back(MiddleOf(b.hulls[i]).x(), i);
  std::sort(by_x.begin(), by_x.end());
  std::vector<bool> taken(b.hulls.size(), false);
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

MassComparer::MassComparer(const Assembly& a, const Assembly& b) : a_(a), b_(b) {
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
    const BodyShape& from = of_a_[i];
    const BodyShape& to = of_b_[image];
    const Matrix3d& R = mapping.R[i];
    const double mass = std::max(from.mass_kg, to.mass_kg);
    const double length = extent + std::sqrt(std::max(from.inertia.trace(), to.inertia.trace()) /
                                             std::max(mass, 1e-12));
    const double tolerance = kGeometryTolerance * mass;
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
