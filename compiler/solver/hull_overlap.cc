#include "compiler/solver/hull_overlap.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace morphbus::solver {
namespace {

using Eigen::Vector3d;
using model::ConvexHull;
using model::HullEdge;
using model::HullFace;

/// True if the Minkowski difference of the two has no volume, so that a touch is no overlap.
bool DifferenceIsFlat(const ConvexHull& A, const ConvexHull& B_in_A) {
  // A hull without points spans nothing, and a solid makes every difference solid.
  if (A.dimension < 0 || B_in_A.dimension < 0) return true;
  if (A.dimension == 3 || B_in_A.dimension == 3) return false;
  // The difference of two flat hulls is flat if the directions within both span less than space:
  // then the sum of their projectors has no full rank.
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const ConvexHull* hull : {&A, &B_in_A}) {
    for (const Vector3d& p : hull->vertices) {
      const Vector3d arm = p - hull->vertices[0];
      if (arm.norm() > 0.0) spread += arm.normalized() * arm.normalized().transpose();
    }
  }
  constexpr double kParallel = 1e-12;  // the square of an angle
  return std::abs(spread.determinant()) <= kParallel;
}

/// The least depth along the face normals of A, stopping at the first that separates.
double DepthAlongFaces(const ConvexHull& A, const ConvexHull& B, double best) {
  for (const HullFace& face : A.faces) {
    double lowest = std::numeric_limits<double>::infinity();
    for (const Vector3d& p : B.vertices) lowest = std::min(lowest, face.normal.dot(p));
    best = std::min(best, face.offset - lowest);
    if (best <= 0.0) return best;
  }
  return best;
}

/// The same along the face normals of both; those of B do not matter if A's leave `enough` or less.
double DepthAlongFacesOfBoth(const ConvexHull& A, const ConvexHull& B, double enough) {
  const double depth = DepthAlongFaces(A, B, std::numeric_limits<double>::infinity());
  return depth <= enough ? depth : DepthAlongFaces(B, A, depth);
}

/// An edge as the arc between its faces' normals in the Gauss map.
struct Arc {
  Vector3d begin;  ///< A corner of the hull that the edge starts from (m).
  Vector3d along;  ///< From there to the edge's other end (m).
  Vector3d normal_1;
  Vector3d normal_2;
  Vector3d plane;  ///< Normal of the plane through the arc: normal_2 x normal_1.
};

/// The arcs of a hull's edges; `sign` is -1 for those of the hull that is subtracted.
std::vector<Arc> ArcsOf(const ConvexHull& hull, double sign) {
  std::vector<Arc> arcs;
  arcs.reserve(hull.edges.size());
  for (const HullEdge& edge : hull.edges) {
    const Vector3d& begin = hull.vertices[edge.begin];
    arcs.push_back({begin, hull.vertices[edge.end] - begin, sign * edge.normal_1,
                    sign * edge.normal_2, edge.normal_2.cross(edge.normal_1)});
  }
  return arcs;
}

/// True if two arcs of the Gauss map cross.
bool Cross(const Arc& a, const Arc& b) {
  // Each arc must have its ends on both sides of the other's plane, and the crossing must be on the
  // same half of the sphere, not opposite. After D. Gregorius, "The Separating Axis Test between
  // Convex Polyhedra", GDC 2013. Most pairs fail the first test.
  const double b1 = b.normal_1.dot(a.plane);
  const double b2 = b.normal_2.dot(a.plane);
  if (!(b1 * b2 < 0.0)) return false;
  const double a1 = a.normal_1.dot(b.plane);
  const double a2 = a.normal_2.dot(b.plane);
  return a1 * a2 < 0.0 && b1 * a2 > 0.0;
}

/// The least depth along cross products of edges, for the pairs that build a face of A - B.
double DepthAlongEdges(const ConvexHull& A, const ConvexHull& B, double best) {
  // Below this sine of their angle two edges span no plane that could separate anything.
  constexpr double kParallelEdges = 1e-9;
  const std::vector<Arc> arcs_b = ArcsOf(B, -1.0);
  for (const Arc& a : ArcsOf(A, 1.0)) {
    for (const Arc& b : arcs_b) {
      if (!Cross(a, b)) continue;
      Vector3d axis = a.along.cross(b.along);
      const double length = axis.norm();
      if (length <= kParallelEdges * a.along.norm() * b.along.norm()) continue;
      axis /= length;
      // The axis must point out of A, as the edge's faces do.
      if (axis.dot(a.normal_1 + a.normal_2) < 0.0) axis = -axis;
      best = std::min(best, axis.dot(a.begin - b.begin));
      if (best <= 0.0) return best;
    }
  }
  return best;
}

/// True if a corner of B, or their mean, lies deeper in the solid A than `tolerance`: leaving A
/// takes it at least that far, so B cannot be separated by less.
bool HasCornerDeepIn(const ConvexHull& A, const ConvexHull& B, double tolerance) {
  if (A.dimension < 3 || B.vertices.empty()) return false;
  const auto is_deep = [&](const Vector3d& p) {
    return std::all_of(A.faces.begin(), A.faces.end(), [&](const HullFace& face) {
      return face.offset - face.normal.dot(p) > tolerance;
    });
  };
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& p : B.vertices) mean += p;
  // The mean catches a small hull whose corners all lie near the surface of A.
  return is_deep(mean / static_cast<double>(B.vertices.size())) ||
         std::any_of(B.vertices.begin(), B.vertices.end(), is_deep);
}

}  // namespace

ConvexHull Moved(const ConvexHull& hull, const model::Pose& X) {
  ConvexHull moved;
  moved.dimension = hull.dimension;
  moved.vertices.reserve(hull.vertices.size());
  for (const Vector3d& p : hull.vertices) moved.vertices.push_back(X * p);
  moved.faces.reserve(hull.faces.size());
  for (const HullFace& face : hull.faces) {
    const Vector3d normal = X.linear() * face.normal;
    moved.faces.push_back({normal, face.offset + normal.dot(X.translation()), {}});
  }
  moved.edges.reserve(hull.edges.size());
  for (const HullEdge& edge : hull.edges) {
    moved.edges.push_back(
        {edge.begin, edge.end, X.linear() * edge.normal_1, X.linear() * edge.normal_2});
  }
  return moved;
}

double PenetrationDepth(const ConvexHull& A, const model::Pose& X_WA, const ConvexHull& B,
                        const model::Pose& X_WB) {
  return PenetrationDepth(A, Moved(B, X_WA.inverse(Eigen::Isometry) * X_WB));
}

double PenetrationDepth(const ConvexHull& A, const ConvexHull& B_in_A) {
  // The candidates for the least translation are the face normals of both, then the edge pairs. The
  // cheap tests come first, as most pairs of hulls are apart.
  double depth = DepthAlongFacesOfBoth(A, B_in_A, 0.0);
  if (depth <= 0.0 || DifferenceIsFlat(A, B_in_A)) return 0.0;
  depth = DepthAlongEdges(A, B_in_A, depth);
  return std::isfinite(depth) ? std::max(depth, 0.0) : 0.0;
}

bool PenetratesBy(double tolerance, const ConvexHull& A, const model::Pose& X_WA,
                  const ConvexHull& B, const model::Pose& X_WB, double* work) {
  const ConvexHull B_in_A = Moved(B, X_WA.inverse(Eigen::Isometry) * X_WB);
  // The work is counted before it is done, so that a caller's bound holds for one pair of huge
  // hulls too.
  const auto size = [](size_t n) { return static_cast<double>(n); };
  *work += 2.0 * (size(A.faces.size()) * size(B.vertices.size()) +
                  size(B.faces.size()) * size(A.vertices.size()));
  const double depth = DepthAlongFacesOfBoth(A, B_in_A, tolerance);
  if (depth <= tolerance) return false;
  // A corner deep inside decides without the quadratic look at all pairs of edges.
  if (HasCornerDeepIn(A, B_in_A, tolerance) || HasCornerDeepIn(B_in_A, A, tolerance)) return true;
  if (DifferenceIsFlat(A, B_in_A)) return false;
  *work += size(A.edges.size()) * size(B.edges.size());
  return DepthAlongEdges(A, B_in_A, depth) > tolerance;
}

double PenetrationDepth(const std::vector<Eigen::Vector3d>& A, const model::Pose& X_WA,
                        const std::vector<Eigen::Vector3d>& B, const model::Pose& X_WB) {
  return PenetrationDepth(model::ComputeHull(A), X_WA, model::ComputeHull(B), X_WB);
}

}  // namespace morphbus::solver
