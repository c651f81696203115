#include "logger/projection.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "compiler/model/convex_hull.h"

namespace morphbus::logger {
namespace {

/// A hull ready to paint: its corners and faces on the picture plane.
struct PaintedHull {
  std::vector<Eigen::Vector3d> corners;  ///< (u, v, depth).
  std::vector<Eigen::Vector3d> normals;  ///< Of all faces, in view coordinates.
  std::vector<double> offsets;
  std::vector<VisibleFace> faces;
  Eigen::Vector3d low, high;  ///< Box around the corners.
  double depth = 0;           ///< Of the centre.
};

/// Light from above, a little from the viewer's left: faces keep their hue and differ in
/// brightness.
Color Shade(const Color& color, const Eigen::Vector3d& normal_V, const Eigen::Vector3d& up_V) {
  const Eigen::Vector3d light = (up_V * 0.75 + Eigen::Vector3d(-0.35, 0.15, 0.6)).normalized();
  const double brightness = 0.62 + 0.40 * std::max(0.0, normal_V.dot(light));
  Color shaded = color;
  for (double& c : shaded) c = std::min(1.0, c * brightness);
  return shaded;
}

PaintedHull Paint(const SceneHull& hull, const Projection& projection) {
  PaintedHull painted;
  // Flat hulls get the thickness of a plate, so that they can be seen edge on.
  constexpr double kPlate = 0.003;
  const model::ConvexHull solid = model::ComputeHull(model::ThickenFlat(hull.points_L, kPlate));
  const Eigen::Vector3d up_V = projection.Direction(Eigen::Vector3d::UnitY());
  painted.low.setConstant(std::numeric_limits<double>::infinity());
  painted.high = -painted.low;
  for (const Eigen::Vector3d& p_L : solid.vertices) {
    const Eigen::Vector3d p = projection.Project(hull.X_WL * p_L);
    painted.corners.push_back(p);
    painted.low = painted.low.cwiseMin(p);
    painted.high = painted.high.cwiseMax(p);
    painted.depth += p.z() / static_cast<double>(solid.vertices.size());
  }
  for (const model::HullFace& face : solid.faces) {
    const Eigen::Vector3d normal = projection.Direction(hull.X_WL.linear() * face.normal);
    painted.normals.push_back(normal);
    painted.offsets.push_back(
        normal.dot(painted.corners[static_cast<size_t>(face.polygon.front())]));
    if (normal.z() <= 1e-6) continue;
    VisibleFace visible;
    visible.color = Shade(hull.color, normal, up_V);
    for (const int corner : face.polygon) {
      const Eigen::Vector3d& p = painted.corners[static_cast<size_t>(corner)];
      visible.outline.emplace_back(p.x(), p.y());
      visible.depth += p.z() / static_cast<double>(face.polygon.size());
    }
    painted.faces.push_back(visible);
  }
  return painted;
}

bool OverlapOnPicture(const PaintedHull& a, const PaintedHull& b) {
  return a.low.x() < b.high.x() && b.low.x() < a.high.x() && a.low.y() < b.high.y() &&
         b.low.y() < a.high.y();
}

/// +1 if a face plane of `a` has all of `b` on its outer side and looks at the viewer (b is in
/// front), -1 if such a plane looks away (b is behind), 0 if no face plane of `a` decides.
int SideOf(const PaintedHull& a, const PaintedHull& b) {
  constexpr double kTouch = 1e-3;  // Hulls of mated modules touch; blunt tips overlap a little.
  for (size_t f = 0; f < a.normals.size(); ++f) {
    if (std::abs(a.normals[f].z()) < 1e-3) continue;  // Edge on: says nothing of who covers whom.
    bool outside = true;
    for (const Eigen::Vector3d& p : b.corners) {
      outside = outside && a.normals[f].dot(p) >= a.offsets[f] - kTouch;
    }
    if (outside) return a.normals[f].z() > 0 ? 1 : -1;
  }
  return 0;
}

/// True if `a` must be painted before `b`.
bool Behind(const PaintedHull& a, const PaintedHull& b) {
  if (const int side = SideOf(a, b); side != 0) return side > 0;
  if (const int side = SideOf(b, a); side != 0) return side < 0;
  return a.depth < b.depth;
}

/// Order in which to paint: repeatedly the farthest hull that nothing unpainted lies behind; where
/// hulls cover each other in a ring, the farthest.
std::vector<size_t> PaintingOrder(const std::vector<PaintedHull>& hulls) {
  std::vector<size_t> by_depth(hulls.size());
  for (size_t i = 0; i < hulls.size(); ++i) by_depth[i] = i;
  std::stable_sort(by_depth.begin(), by_depth.end(),
                   [&](size_t a, size_t b) { return hulls[a].depth < hulls[b].depth; });
  std::vector<size_t> order;
  while (!by_depth.empty()) {
    size_t pick = 0;
    for (size_t i = 0; i < by_depth.size(); ++i) {
      const bool covered_first = std::none_of(by_depth.begin(), by_depth.end(), [&](size_t other) {
        return other != by_depth[i] && OverlapOnPicture(hulls[other], hulls[by_depth[i]]) &&
               Behind(hulls[other], hulls[by_depth[i]]);
      });
      if (covered_first) {
        pick = i;
        break;
      }
    }
    order.push_back(by_depth[pick]);
    by_depth.erase(by_depth.begin() + static_cast<std::ptrdiff_t>(pick));
  }
  return order;
}

}  // namespace

Projection::Projection(View view) {
  Eigen::Vector3d towards = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();
  switch (view) {
    case View::kSide:
      edge_on_ = true;
      break;
    case View::kTop:
      towards = Eigen::Vector3d::UnitY();
      break;
    case View::kFront:
      towards = Eigen::Vector3d::UnitX();
      right = -Eigen::Vector3d::UnitZ();
      edge_on_ = true;
      break;
    case View::kThreeQuarter:
      towards = Eigen::Vector3d(0.55, 0.55, 0.8).normalized();
      right = Eigen::Vector3d::UnitY().cross(towards).normalized();
      break;
  }
  R_.row(0) = right;
  R_.row(1) = towards.cross(right);
  R_.row(2) = towards;
}

Eigen::Vector3d Projection::GroundPointAt(double u, double v) const {
  const Eigen::Vector3d base = R_.transpose() * Eigen::Vector3d(u, v, 0);
  const Eigen::Vector3d towards = R_.row(2);
  return base - towards * (base.y() / towards.y());
}

std::vector<VisibleFace> VisibleFaces(const Scene& scene, const Projection& projection) {
  std::vector<PaintedHull> hulls;
  for (const SceneHull& hull : scene.hulls) {
    if (hull.points_L.empty()) continue;
    hulls.push_back(Paint(hull, projection));
  }
  std::vector<VisibleFace> faces;
  for (const size_t i : PaintingOrder(hulls)) {
    std::stable_sort(hulls[i].faces.begin(), hulls[i].faces.end(),
                     [](const VisibleFace& a, const VisibleFace& b) { return a.depth < b.depth; });
    faces.insert(faces.end(), hulls[i].faces.begin(), hulls[i].faces.end());
  }
  return faces;
}

}  // namespace morphbus::logger
