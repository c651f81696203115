#include "logger/show/projection.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <numeric>
#include <set>
#include <span>
#include <utility>

#include "compiler/model/convex_hull.h"

namespace morphbus::logger {
namespace {

/// A hull ready to paint: its corners and faces in view coordinates (u, v, depth), metres.
struct PaintedHull {
  /// The corners of the hull.
  std::vector<Eigen::Vector3d> corners;  ///< (u, v, depth).
  /// Outward normals of all faces, those that look away included; each face's plane is normal · p =
  /// offset.
  std::vector<Eigen::Vector3d> normals;
  std::vector<double> offsets;
  /// The faces that look at the viewer.
  std::vector<VisibleFace> faces;
  /// Box around the corners, on the picture plane.
  Eigen::AlignedBox2d box;
  /// Mean depth of the corners.
  double depth = 0;
  /// Whether it is a terrain, which parts no hulls; it has no normals then.
  bool is_surface = false;
  /// Whether it is drawn as triangles, behind whose outline something else may be seen.
  bool is_mesh = false;
};

/// The color of a face: light comes from above, a little from the viewer's left, so that faces keep
/// their hue and differ in brightness. Both vectors are in view coordinates.
Color Shade(const Color& color, const Eigen::Vector3d& normal_V, const Eigen::Vector3d& up_V) {
  const Eigen::Vector3d light = (up_V * 0.75 + Eigen::Vector3d(-0.35, 0.15, 0.6)).normalized();
  // Faces away from the light keep 62 % of their color; nothing is black.
  const double brightness = 0.62 + 0.40 * std::max(0.0, normal_V.dot(light));
  Color shaded = color;
  for (double& c : shaded) c = std::min(1.0, c * brightness);
  return shaded;
}

/// The corners of a body on the picture plane, their box and their mean depth.
PaintedHull PlaceCorners(const std::vector<Eigen::Vector3d>& points_L, const model::Pose& X_WL,
                         const Projection& projection) {
  PaintedHull painted;
  for (const Eigen::Vector3d& p_L : points_L) {
    const Eigen::Vector3d p = projection.Project(X_WL * p_L);
    painted.corners.push_back(p);
    painted.box.extend(Eigen::Vector2d(p.head<2>()));
    painted.depth += p.z() / static_cast<double>(points_L.size());
  }
  return painted;
}

/// Whether the side between two faces of these normals (view coordinates) is drawn: they meet
/// sharply, or one is seen and the other not.
bool IsEdge(const Eigen::Vector3d& normal_1, const Eigen::Vector3d& normal_2) {
  // Faces that turn by less than 20 degrees stand for a curved surface.
  constexpr double kSmooth = 0.94;
  constexpr double kSeen = 1e-6;
  return normal_1.dot(normal_2) < kSmooth || (normal_1.z() > kSeen) != (normal_2.z() > kSeen);
}

/// The normals of the faces at each side, whose ends are numbers of corners, the lower one first.
using SideNormals = std::map<std::pair<int, int>, std::vector<Eigen::Vector3d>>;

std::pair<int, int> SideBetween(int a, int b) { return std::minmax({a, b}); }

/// Which sides of a polygon of these corners are drawn.
std::vector<bool> EdgesOf(const std::span<const int> polygon, const SideNormals& sides) {
  std::vector<bool> edges;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const auto& normals = sides.at(SideBetween(polygon[i], polygon[(i + 1) % polygon.size()]));
    // Where a surface ends there is one face only.
    edges.push_back(normals.size() < 2 || IsEdge(normals[0], normals[1]));
  }
  return edges;
}

/// Those of the points that lie farthest along some directions: all that matters of a body for what
/// it lies in front of, however many corners it has.
std::vector<Eigen::Vector3d> FarthestOf(const std::vector<Eigen::Vector3d>& points) {
  // To the corners of the squares into which the faces of a cube are cut: 98 directions, by which a
  // round body is known to some hundredths of its size.
  constexpr int kSteps = 4;
  std::set<size_t> farthest;
  for (int x = -kSteps; x <= kSteps; x += 2) {
    for (int y = -kSteps; y <= kSteps; y += 2) {
      for (int z = -kSteps; z <= kSteps; z += 2) {
        if (std::max({std::abs(x), std::abs(y), std::abs(z)}) != kSteps) continue;
        const Eigen::Vector3d direction(x, y, z);
        farthest.insert(static_cast<size_t>(
            std::ranges::max_element(points, {}, [&](const auto& p) { return direction.dot(p); }) -
            points.begin()));
      }
    }
  }
  std::vector<Eigen::Vector3d> kept;
  for (const size_t i : farthest) kept.push_back(points[i]);
  return kept;
}

/// The planes of the convex hull of a mesh, by which it is ordered among other bodies.
void AddPlanes(const SceneHull& mesh, const Projection& projection, PaintedHull* painted) {
  // A painter compares each plane of a body with each corner of another one.
  constexpr size_t kManyCorners = 200;
  const bool many = mesh.points_L.size() > kManyCorners;
  const model::ConvexHull hull =
      model::ComputeHull(many ? FarthestOf(mesh.points_L) : mesh.points_L);
  for (const model::HullFace& face : hull.faces) {
    const Eigen::Vector3d normal = projection.Direction(mesh.X_WL.linear() * face.normal);
    const Eigen::Vector3d corner = mesh.X_WL * hull.vertices[face.polygon.front()];
    painted->normals.push_back(normal);
    painted->offsets.push_back(normal.dot(projection.Project(corner)));
  }
}

/// Brings triangles into view coordinates, shaded on the side that is seen; edge on their outlines
/// remain. Those of a terrain, which no module owns, part no hulls.
PaintedHull PaintTriangles(const SceneHull& hull, const Projection& projection) {
  PaintedHull painted = PlaceCorners(hull.points_L, hull.X_WL, projection);
  painted.is_surface = hull.owner < 0;
  painted.is_mesh = true;
  if (!painted.is_surface) AddPlanes(hull, projection, &painted);
  const auto normal_of = [&](const std::array<int, 3>& triangle) {
    const Eigen::Vector3d& a = painted.corners[triangle[0]];
    const Eigen::Vector3d& b = painted.corners[triangle[1]];
    const Eigen::Vector3d& c = painted.corners[triangle[2]];
    return Eigen::Vector3d((b - a).cross(c - a).normalized());
  };
  SideNormals sides;
  for (const std::array<int, 3>& triangle : hull.triangles) {
    for (int k = 0; k < 3; ++k) {
      sides[SideBetween(triangle[k], triangle[(k + 1) % 3])].push_back(normal_of(triangle));
    }
  }
  const Eigen::Vector3d up_V = projection.Direction(Eigen::Vector3d::UnitY());
  for (const std::array<int, 3>& triangle : hull.triangles) {
    const Eigen::Vector3d& a = painted.corners[triangle[0]];
    const Eigen::Vector3d& b = painted.corners[triangle[1]];
    const Eigen::Vector3d& c = painted.corners[triangle[2]];
    Eigen::Vector3d normal = normal_of(triangle);
    // A surface has two sides: the one that is seen is shaded.
    if (normal.z() < 0) normal = -normal;
    VisibleFace visible;
    visible.owner = hull.owner;
    visible.color = Shade(hull.color, normal, up_V);
    visible.depth = (a.z() + b.z() + c.z()) / 3;
    for (const Eigen::Vector3d& p : {a, b, c}) visible.outline.emplace_back(p.x(), p.y());
    visible.edges = EdgesOf(triangle, sides);
    painted.faces.push_back(visible);
  }
  return painted;
}

/// The solids of a scene's hulls. All modules of a type have the same links, and computing a hull
/// takes longer than painting it; so each set of points is computed once.
class Solids {
 public:
  const model::ConvexHull& Of(const std::vector<Eigen::Vector3d>& points) {
    for (const auto& [known, solid] : solids_) {
      if (*known == points) return solid;
    }
    // Flat hulls get the thickness of a plate, so that they can be seen edge on.
    constexpr double kPlate = 0.003;
    return solids_.emplace_back(&points, model::ComputeHull(model::ThickenFlat(points, kPlate)))
        .second;
  }

 private:
  /// The points, which the scene owns, and their solid.
  std::deque<std::pair<const std::vector<Eigen::Vector3d>*, model::ConvexHull>> solids_;
};

/// Brings a hull with its solid into view coordinates, and shades the faces that are seen.
PaintedHull Paint(const SceneHull& hull, const model::ConvexHull& solid,
                  const Projection& projection) {
  PaintedHull painted = PlaceCorners(solid.vertices, hull.X_WL, projection);
  const Eigen::Vector3d up_V = projection.Direction(Eigen::Vector3d::UnitY());
  SideNormals sides;
  for (const model::HullEdge& edge : solid.edges) {
    for (const Eigen::Vector3d& normal : {edge.normal_1, edge.normal_2}) {
      sides[SideBetween(edge.begin, edge.end)].push_back(
          projection.Direction(hull.X_WL.linear() * normal));
    }
  }
  // All faces help to order hulls; those that look at the viewer are painted.
  for (const model::HullFace& face : solid.faces) {
    const Eigen::Vector3d normal = projection.Direction(hull.X_WL.linear() * face.normal);
    painted.normals.push_back(normal);
    painted.offsets.push_back(normal.dot(painted.corners[face.polygon.front()]));
    if (normal.z() <= 1e-6) continue;
    VisibleFace visible;
    visible.owner = hull.owner;
    visible.color = Shade(hull.color, normal, up_V);
    for (const int corner : face.polygon) {
      const Eigen::Vector3d& p = painted.corners[corner];
      visible.outline.emplace_back(p.x(), p.y());
      visible.depth += p.z() / static_cast<double>(face.polygon.size());
    }
    visible.edges = EdgesOf(face.polygon, sides);
    painted.faces.push_back(visible);
  }
  return painted;
}

/// Whether the boxes of two hulls overlap on the picture plane.
bool OverlapOnPicture(const PaintedHull& a, const PaintedHull& b) {
  return (a.box.min().array() < b.box.max().array()).all() &&
         (b.box.min().array() < a.box.max().array()).all();
}

/// Whether all of `b` lies within the convex hull `a`, so that nothing of it is seen.
bool Contains(const PaintedHull& a, const PaintedHull& b) {
  // What lies flush with a face, but for rounding, is inside.
  constexpr double kRounding = 1e-6;
  if (a.is_mesh || !a.box.contains(b.box.min()) || !a.box.contains(b.box.max())) return false;
  for (size_t f = 0; f < a.normals.size(); ++f) {
    for (const Eigen::Vector3d& p : b.corners) {
      if (a.normals[f].dot(p) > a.offsets[f] + kRounding) return false;
    }
  }
  return true;
}

/// Takes away the hulls that lie within another one: they share no side of a plane with it, so that
/// a painter's order could put them over it. Of two that are the same the first stays.
void RemoveHidden(std::vector<PaintedHull>* hulls) {
  std::vector<PaintedHull> seen;
  for (size_t i = 0; i < hulls->size(); ++i) {
    bool hidden = false;
    for (size_t j = 0; j < hulls->size() && !hidden; ++j) {
      const PaintedHull& one = (*hulls)[i];
      const PaintedHull& other = (*hulls)[j];
      hidden = j != i && Contains(other, one) && (j < i || !Contains(one, other));
    }
    if (!hidden) seen.push_back((*hulls)[i]);
  }
  *hulls = std::move(seen);
}

/// Separates two hulls by a face plane of `a`: +1 if all of `b` is on the outer side of one that
/// looks at the viewer (b is in front), -1 if of one that looks away (b is behind), 0 if no face
/// plane decides.
int SideOf(const PaintedHull& a, const PaintedHull& b) {
  constexpr double kTouch = 1e-3;  // Hulls of mated modules touch; blunt tips overlap a little.
  for (size_t f = 0; f < a.normals.size(); ++f) {
    if (std::abs(a.normals[f].z()) < 1e-3) continue;  // Edge on: says nothing of what covers what.
    // A plane with all of b's corners outside has all of b outside, since b is convex.
    const bool outside = std::all_of(b.corners.begin(), b.corners.end(), [&](const auto& p) {
      return a.normals[f].dot(p) >= a.offsets[f] - kTouch;
    });
    if (outside) return a.normals[f].z() > 0 ? 1 : -1;
  }
  return 0;
}

/// True if `a` must be painted before `b`.
bool Behind(const PaintedHull& a, const PaintedHull& b) {
  // A separating plane of either hull decides; without one, the mean depth is the best guess.
  if (const int side = SideOf(a, b); side != 0) return side > 0;
  if (const int side = SideOf(b, a); side != 0) return side < 0;
  // A hull that meets a surface stands on it, and is painted over it.
  if (a.is_surface != b.is_surface) return a.is_surface;
  return a.depth < b.depth;
}

/// Order in which to paint: repeatedly the farthest hull behind which nothing unpainted lies; where
/// hulls cover each other in a ring, the farthest. Quadratic in the number of hulls.
std::vector<size_t> PaintingOrder(const std::vector<PaintedHull>& hulls) {
  // For each hull those that it covers up, and how many unpainted ones have to come before it.
  // Hulls that do not meet on the picture cannot cover each other, and are not compared.
  std::vector<std::vector<size_t>> before(hulls.size());
  std::vector<int> waits_for(hulls.size(), 0);
  for (size_t i = 0; i < hulls.size(); ++i) {
    for (size_t j = 0; j < hulls.size(); ++j) {
      if (i == j || !OverlapOnPicture(hulls[i], hulls[j]) || !Behind(hulls[i], hulls[j])) continue;
      before[i].push_back(j);
      ++waits_for[j];
    }
  }
  std::vector<size_t> by_depth(hulls.size());
  std::iota(by_depth.begin(), by_depth.end(), 0);
  std::ranges::stable_sort(by_depth, {}, [&](size_t i) { return hulls[i].depth; });
  std::vector<size_t> order;
  while (!by_depth.empty()) {
    auto pick = std::ranges::find_if(by_depth, [&](size_t i) { return waits_for[i] == 0; });
    // A ring of hulls that each cover another one has no right order; the farthest is the least
    // wrong.
    if (pick == by_depth.end()) pick = by_depth.begin();
    order.push_back(*pick);
    for (const size_t later : before[*pick]) --waits_for[later];
    by_depth.erase(pick);
  }
  return order;
}

}  // namespace

Projection::Projection(View view) {
  // Side view: from the east, with north to the right. Up follows from both directions.
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
      break;
    case View::kFromNorthWest:
      towards = Eigen::Vector3d(0.55, 0.55, -0.8).normalized();
      break;
    case View::kFromSouthWest:
      towards = Eigen::Vector3d(-0.55, 0.55, -0.8).normalized();
      break;
    case View::kFromSouthEast:
      towards = Eigen::Vector3d(-0.55, 0.55, 0.8).normalized();
      break;
    case View::kFromBelow:
      towards = Eigen::Vector3d(-0.55, -0.55, -0.8).normalized();
      break;
  }
  // From a corner up stays up, and the level direction at right angles to the view is to the right.
  if (view >= View::kThreeQuarter) {
    right = Eigen::Vector3d::UnitY().cross(towards).normalized();
  }
  // The rows are the axes of the view in W: right, up, and towards the viewer, which is depth.
  R_.row(0) = right;
  R_.row(1) = towards.cross(right);
  R_.row(2) = towards;
}

Eigen::Vector3d Projection::GroundPointAt(double u, double v) const {
  // From (u, v, 0) along the line of sight to the height 0.
  const Eigen::Vector3d base = R_.transpose() * Eigen::Vector3d(u, v, 0);
  const Eigen::Vector3d towards = R_.row(2);
  return base - towards * (base.y() / towards.y());
}

std::vector<VisibleFace> VisibleFaces(const Scene& scene, const Projection& projection) {
  std::vector<PaintedHull> hulls;
  Solids solids;
  // Links without a body are not seen.
  for (const SceneHull& hull : scene.hulls) {
    if (hull.points_L.empty()) continue;
    hulls.push_back(hull.triangles.empty() ? Paint(hull, solids.Of(hull.points_L), projection)
                                           : PaintTriangles(hull, projection));
  }
  RemoveHidden(&hulls);
  std::vector<VisibleFace> faces;
  // Within a hull the farther faces come first.
  for (const size_t i : PaintingOrder(hulls)) {
    std::stable_sort(hulls[i].faces.begin(), hulls[i].faces.end(),
                     [](const VisibleFace& a, const VisibleFace& b) { return a.depth < b.depth; });
    faces.insert(faces.end(), hulls[i].faces.begin(), hulls[i].faces.end());
  }
  return faces;
}

bool Covers(const VisibleFace& face, const Eigen::Vector2d& p) {
  // Faces are convex: the point lies on one side of all edges.
  bool left = false;
  bool right = false;
  for (size_t i = 0; i < face.outline.size(); ++i) {
    const Eigen::Vector2d& a = face.outline[i];
    const Eigen::Vector2d edge = face.outline[(i + 1) % face.outline.size()] - a;
    const double cross = edge.x() * (p.y() - a.y()) - edge.y() * (p.x() - a.x());
    left = left || cross > 0;
    right = right || cross < 0;
  }
  return !(left && right);
}

std::optional<int> OwnerAt(const std::vector<VisibleFace>& faces, const Eigen::Vector2d& p) {
  // What is painted last is seen.
  for (auto face = faces.rbegin(); face != faces.rend(); ++face) {
    if (Covers(*face, p)) return face->owner;
  }
  return std::nullopt;
}

}  // namespace morphbus::logger
