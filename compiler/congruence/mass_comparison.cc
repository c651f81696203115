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

/// A link's mass distribution and the corners of its convex parts, in its module's frame.
struct LinkShape {
  model::LinkMass mass;
  std::vector<std::vector<Vector3d>> parts;  ///< None if the link has no hull.
};

/// The shapes of all bodies; those of the links of each module type are worked out once.
std::vector<BodyShape> ShapesOf(const ScrewGraph& graph) {
  std::map<std::pair<int, int>, LinkShape> links;  // by module type and link
  std::vector<BodyShape> shapes;
  for (const ScrewBody& body : graph.bodies) {
    BodyShape& shape = shapes.emplace_back();
    for (const model::LinkRef& ref : body.links) {
      const model::ModuleType& type = graph.model->TypeOf(*graph.robot, ref.module);
      const auto [entry, fresh] =
          links.try_emplace({graph.robot->modules[ref.module].type, ref.link});
      auto& [mass, parts] = entry->second;
      if (fresh) {
        mass = model::ComputeLinkMass(type, ref.link);
        for (const auto& points : type.links[ref.link].Parts()) {
          parts.push_back(model::ComputeHull(points).vertices);
        }
      }
      // Moments about the reference point add up over the links (parallel axis theorem).
      // T has the robot frame's directions, and its origin in the body's reference point.
      model::Pose X_TL = graph.X_RL[ref.module][ref.link];
      X_TL.translation() -= body.p_RoTo;
      const Vector3d centre = X_TL * mass.p_LoLcm_L;
      shape.mass_kg += mass.mass_kg;
      shape.moment += mass.mass_kg * centre;
      shape.inertia += X_TL.linear() * mass.I_Lcm_L * X_TL.linear().transpose() +
                       mass.mass_kg * (centre.squaredNorm() * Matrix3d::Identity() -
                                       centre * centre.transpose());
      for (const std::vector<Vector3d>& corners : parts) {
        std::vector<Vector3d>& hull = shape.hulls.emplace_back();
        for (const Vector3d& p : corners) hull.push_back(X_TL * p);
      }
    }
  }
  return shapes;
}

/// The mean of the points.
Vector3d MiddleOf(const std::vector<Vector3d>& points) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

/// Has each point of a one of b within `tolerance` (m), and are they as many?
bool SamePoints(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b, double tolerance) {
  // As many points, of which no two coincide, so that each has a partner of its own.
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
  // The hulls of b that are not taken yet.
  std::multimap<double, const std::vector<Vector3d>*> by_x;
  for (const std::vector<Vector3d>& hull : b.hulls) by_x.emplace(MiddleOf(hull).x(), &hull);
  // Each of a, turned, takes the first of those near its x that is the same.
  for (std::vector<Vector3d> hull : a.hulls) {
    for (Vector3d& p : hull) p = R * p;
    const double x = MiddleOf(hull).x();
    const auto end = by_x.upper_bound(x + tolerance);
    const auto same = std::find_if(by_x.lower_bound(x - tolerance), end, [&](const auto& other) {
      return SamePoints(hull, *other.second, tolerance);
    });
    if (same == end) return false;
    by_x.erase(same);
  }
  return true;
}

}  // namespace

MassComparer::MassComparer(const ScrewGraph& a, const ScrewGraph& b)
    : a_(a),
      b_(b),
      of_a_(ShapesOf(a)),
      of_b_(ShapesOf(b)),
      extent_m_(std::max(a.extent_m, b.extent_m)) {}

std::string MassComparer::PairName(int body, int image) const {
  return a_.BodyName(body) + " and " + b_.BodyName(image);
}

std::string MassComparer::MassDifference(int body, int image, const Matrix3d& R) const {
  // Lengths are compared to a part of the assemblies' extent and the body's own.
  const BodyShape& from = of_a_[body];
  const BodyShape& to = of_b_[image];
  const double mass = std::max(from.mass_kg, to.mass_kg);
  // The radius of gyration is a length of the body's own: masses may lie far outside of its joints.
  const double length = extent_m_ + std::sqrt(std::max(from.inertia.trace(), to.inertia.trace()) /
                                              std::max(mass, 1e-12));
  // Of masses, moments (times a length) and inertias (times its square) the same part.
  const double tolerance = kGeometryTolerance * mass;
  if (std::abs(from.mass_kg - to.mass_kg) > tolerance) {
    return fmt::format("{} weigh {:.6g} and {:.6g} kg", PairName(body, image), from.mass_kg,
                       to.mass_kg);
  }
  const double apart = (R * from.moment - to.moment).norm();
  if (apart > tolerance * length) {
    return fmt::format("the centres of mass of {} are {:.3g} m apart", PairName(body, image),
                       apart / mass);
  }
  const double unlike = (R * from.inertia * R.transpose() - to.inertia).norm();
  if (unlike <= tolerance * length * length) return {};
  return PairName(body, image) + " have different moments of inertia";
}

MassComparison MassComparer::Compare(const Mapping& mapping) const {
  MassComparison result;
  // Only the first difference is told.
  for (size_t i = 0; i < of_a_.size(); ++i) {
    const int body = static_cast<int>(i);
    const int image = mapping.body_to[i];
    const Matrix3d& R = mapping.R[i];
    if (result.masses_equal) {
      result.mass_difference = MassDifference(body, image, R);
      result.masses_equal = result.mass_difference.empty();
    }
    if (result.hulls_equal &&
        !SameHulls(of_a_[i], of_b_[image], R, kGeometryTolerance * extent_m_)) {
      result.hulls_equal = false;
      result.hull_difference = PairName(body, image) + " have different hulls";
    }
  }
  return result;
}

}  // namespace morphbus::congruence
