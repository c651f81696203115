#include "compiler/model/convex_hull.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include "compiler/base/disjoint_sets.h"

namespace morphbus::model {
namespace {

using Eigen::Vector3d;
using Points = std::vector<Vector3d>;

/// Relative to the set's extent; see ComputeHull.
constexpr double kFlatness = 1e-9;

/// The largest side of the box round the points (m); 0 for none.
double ExtentOfPoints(const Points& points) {
  Eigen::AlignedBox3d box;
  for (const Vector3d& p : points) box.extend(p);
  return box.isEmpty() ? 0.0 : box.sizes().maxCoeff();
}

/// The indices of all points.
std::vector<int> AllOf(const Points& points) {
  std::vector<int> all(points.size());
  std::iota(all.begin(), all.end(), 0);
  return all;
}

/// The index for which `measure` is greatest, the first one on ties.
template <typename Measure>
int ArgMax(size_t count, const Measure& measure) {
  int best = 0;
  double best_value = -std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < count; ++i) {
    const double value = measure(static_cast<int>(i));
    if (value > best_value) {
      best_value = value;
      best = static_cast<int>(i);
    }
  }
  return best;
}

/// Points that span the set as widely as greedy choice finds, and how many dimensions they span.
struct Span {
  int dimension = 0;
  std::array<int, 4> index{};  ///< The first dimension + 1 are used.
};

/// Chooses the points greedily: two far apart, then the farthest off their line, then the farthest
/// off the plane. What is no farther than `tolerance` adds no dimension.
Span FindSpan(const Points& points, double tolerance) {
  Span span;
  // The first point is far from the middle of a far pair, so that it is a corner whatever the
  // order of the points.
  const Vector3d middle =
      0.5 *
      (points[0] +
       points[ArgMax(points.size(), [&](int i) { return (points[i] - points[0]).squaredNorm(); })]);
  span.index[0] = ArgMax(points.size(), [&](int i) { return (points[i] - middle).squaredNorm(); });
  const Vector3d o = points[span.index[0]];
  span.index[1] = ArgMax(points.size(), [&](int i) { return (points[i] - o).squaredNorm(); });
  Vector3d along = points[span.index[1]] - o;
  if (along.norm() <= tolerance) return span;
  along.normalize();
  span.dimension = 1;
  const auto off_line = [&](int i) { return (points[i] - o).cross(along).norm(); };
  span.index[2] = ArgMax(points.size(), off_line);
  if (off_line(span.index[2]) <= tolerance) return span;
  span.dimension = 2;
  const Vector3d normal = along.cross(points[span.index[2]] - o).normalized();
  const auto off_plane = [&](int i) { return std::abs(normal.dot(points[i] - o)); };
  span.index[3] = ArgMax(points.size(), off_plane);
  if (off_plane(span.index[3]) <= tolerance) return span;
  span.dimension = 3;
  return span;
}

/// Of each edge, from corner to corner, the face that lies left of it.
using DirectedEdges = std::map<std::pair<int, int>, int>;

/// Adds the edges round a face, whose corners stand counter-clockwise.
template <typename Corners>
void AddEdges(const Corners& corners, int face, DirectedEdges& left_of) {
  for (size_t k = 0; k < corners.size(); ++k) {
    left_of[{corners[k], corners[(k + 1) % corners.size()]}] = face;
  }
}

/// Quickhull on a set that spans three dimensions. Facets are triangles, outward. Not that of
/// qhull, which rounds otherwise on other processors (docs/libraries.md).
class QuickHull {
 public:
  QuickHull(const Points& points, const Span& span, double tolerance)
      : points_(points), tolerance_(tolerance) {
    StartFromTetrahedron(span.index);
    // Every round adds one corner, so this ends; new facets go to the back and are met later.
    for (size_t i = 0; i < facets_.size(); ++i) {
      while (facets_[i].alive && !facets_[i].outside.empty()) AddFarthest(static_cast<int>(i));
    }
  }

  [[nodiscard]] std::vector<std::array<int, 3>> Triangles() const {
    std::vector<std::array<int, 3>> result;
    for (const Facet& facet : facets_) {
      if (facet.alive) result.push_back(facet.corner);
    }
    return result;
  }

 private:
  struct Facet {
    std::array<int, 3> corner;
    Vector3d normal;
    double offset = 0.0;
    std::vector<int> outside;  ///< Points above this facet that no earlier facet claimed.
    bool alive = true;
  };

  /// The height of a point over the facet's plane (m).
  [[nodiscard]] double Above(const Facet& facet, int point) const {
    return facet.normal.dot(points_[point]) - facet.offset;
  }

  /// Adds the triangle a, b, c, counter-clockwise from outside; returns its index.
  int AddFacet(int a, int b, int c) {
    Facet facet;
    facet.corner = {a, b, c};
    facet.normal = (points_[b] - points_[a]).cross(points_[c] - points_[a]);
    const double length = facet.normal.norm();
    if (length > 0.0) facet.normal /= length;
    facet.offset = facet.normal.dot(points_[a] + points_[b] + points_[c]) / 3.0;
    const int index = static_cast<int>(facets_.size());
    AddEdges(facet.corner, index, edges_);
    facets_.push_back(std::move(facet));
    return index;
  }

  /// The first four facets, all facing outwards, and the points outside them.
  void StartFromTetrahedron(std::array<int, 4> t) {
    // The fourth point must lie below the first triangle.
    const Vector3d normal = (points_[t[1]] - points_[t[0]]).cross(points_[t[2]] - points_[t[0]]);
    if (normal.dot(points_[t[3]] - points_[t[0]]) > 0.0) std::swap(t[1], t[2]);
    const std::vector<int> fresh = {AddFacet(t[0], t[1], t[2]), AddFacet(t[0], t[3], t[1]),
                                    AddFacet(t[1], t[3], t[2]), AddFacet(t[2], t[3], t[0])};
    Distribute(AllOf(points_), fresh);
  }

  /// Gives each point to the first facet that it lies above; the others are inside for good.
  void Distribute(const std::vector<int>& orphans, const std::vector<int>& facets) {
    for (const int point : orphans) {
      for (const int f : facets) {
        if (Above(facets_[f], point) > tolerance_) {
          facets_[f].outside.push_back(point);
          break;
        }
      }
    }
  }

  /// Takes up the point that lies farthest above facet `from` as a corner: the facets that it sees
  /// are replaced by a cone to their rim.
  void AddFarthest(int from) {
    const std::vector<int>& outside = facets_[from].outside;
    const int apex =
        outside[ArgMax(outside.size(), [&](int i) { return Above(facets_[from], outside[i]); })];
    // The visible facets are taken by flood fill, so that they stay one patch whatever rounding
    // does.
    std::vector<int> visible = {from};
    facets_[from].alive = false;
    std::vector<std::pair<int, int>> horizon;
    for (size_t i = 0; i < visible.size(); ++i) {
      const std::array<int, 3> c = facets_[visible[i]].corner;
      for (int k = 0; k < 3; ++k) {
        const auto neighbour = edges_.find({c[(k + 1) % 3], c[k]});
        if (neighbour == edges_.end() || !facets_[neighbour->second].alive) continue;
        if (Above(facets_[neighbour->second], apex) > tolerance_) {
          facets_[neighbour->second].alive = false;
          visible.push_back(neighbour->second);
        } else {
          horizon.emplace_back(c[k], c[(k + 1) % 3]);
        }
      }
    }
    Replace(visible, horizon, apex);
  }

  /// Cuts the visible facets out and closes the hole from its rim to `apex`; points above the old
  /// facets go to the new ones.
  void Replace(const std::vector<int>& visible, const std::vector<std::pair<int, int>>& horizon,
               int apex) {
    // Points above the old facets have to be given to new ones.
    std::vector<int> orphans;
    for (const int f : visible) {
      for (const int point : facets_[f].outside) {
        if (point != apex) orphans.push_back(point);
      }
      facets_[f].outside.clear();
    }
    std::vector<int> fresh;
    for (const auto& [begin, end] : horizon) {
      // An edge next to a facet met late in the flood fill may be inside the patch after all.
      const auto outer = edges_.find({end, begin});
      if (outer == edges_.end() || !facets_[outer->second].alive) continue;
      fresh.push_back(AddFacet(begin, end, apex));
    }
    Distribute(orphans, fresh);
  }

  const Points& points_;
  double tolerance_;
  std::vector<Facet> facets_;
  DirectedEdges edges_;
};

/// The normal of a triangle, as long as twice its area.
Vector3d TriangleNormal(const Points& points, const std::array<int, 3>& t) {
  return (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]);
}

/// Groups triangles that lie in one plane. The tolerance is wide against rounding, narrow against
/// any angle a person would draw.
std::vector<std::vector<int>> CoplanarGroups(const Points& points,
                                             const std::vector<std::array<int, 3>>& triangles,
                                             double extent) {
  constexpr double kSameNormal = 1e-8;
  // Each edge has a triangle on either side; those of like direction are joined.
  DirectedEdges left_of;
  for (int i = 0; i < std::ssize(triangles); ++i) AddEdges(triangles[i], i, left_of);
  DisjointSets planes(static_cast<int>(triangles.size()));
  for (const auto& [edge, i] : left_of) {
    const auto twin = left_of.find({edge.second, edge.first});
    if (twin == left_of.end()) continue;
    const Vector3d n1 = TriangleNormal(points, triangles[i]);
    const Vector3d n2 = TriangleNormal(points, triangles[twin->second]);
    // A sliver has no direction of its own and joins its neighbour.
    const bool sliver = std::min(n1.norm(), n2.norm()) <= kFlatness * extent * extent;
    if (sliver || (n1.normalized() - n2.normalized()).norm() <= kSameNormal) {
      planes.Unite(i, twin->second);
    }
  }
  std::map<int, std::vector<int>> groups;
  for (int i = 0; i < std::ssize(triangles); ++i) groups[planes.Find(i)].push_back(i);
  std::vector<std::vector<int>> result;
  for (auto& [root, members] : groups) result.push_back(std::move(members));
  return result;
}

/// The corners of a planar loop of points, without those on a straight line. Counter-clockwise
/// about `normal`, by monotone chain in the plane (robust where walking triangle edges is not).
std::vector<int> PlanarHull(const Points& points, std::vector<int> candidates,
                            const Vector3d& normal, double tolerance) {
  // The points are sorted along one direction of the plane.
  const Vector3d u = normal.unitOrthogonal();
  const Vector3d v = normal.cross(u);
  std::sort(candidates.begin(), candidates.end());
  candidates.erase(std::unique(candidates.begin(), candidates.end()), candidates.end());
  const auto flat = [&](int i) { return Eigen::Vector2d(u.dot(points[i]), v.dot(points[i])); };
  std::stable_sort(candidates.begin(), candidates.end(), [&](int i, int j) {
    const Eigen::Vector2d a = flat(i);
    const Eigen::Vector2d b = flat(j);
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  // Twice the area of the triangle is the distance of b from the line a–c times the length of a–c:
  // b counts only if it stands out by more than the tolerance.
  const auto left_turn = [&](int a, int b, int c) {
    const Eigen::Vector2d ab = flat(b) - flat(a);
    const Eigen::Vector2d ac = flat(c) - flat(a);
    return ab.x() * ac.y() - ab.y() * ac.x() > tolerance * ac.norm();
  };
  // Two passes, there and back: the lower chain, then the upper one.
  std::vector<int> loop;
  for (int pass = 0; pass < 2; ++pass) {
    const size_t base = loop.size();
    for (const int i : candidates) {
      while (loop.size() >= base + 2 && !left_turn(loop[loop.size() - 2], loop.back(), i)) {
        loop.pop_back();
      }
      loop.push_back(i);
    }
    if (!loop.empty()) loop.pop_back();
    std::reverse(candidates.begin(), candidates.end());
  }
  return loop;
}

/// Adds a face with the mean offset of its corners, which evens out their rounding.
void AddFace(ConvexHull& hull, const Points& points, const Vector3d& normal,
             std::vector<int> polygon) {
  HullFace face;
  face.normal = normal;
  for (const int i : polygon) face.offset += normal.dot(points[i]);
  face.offset /= static_cast<double>(polygon.size());
  face.polygon = std::move(polygon);
  hull.faces.push_back(std::move(face));
}

/// Renumbers the polygons from source points to corners, and keeps those corners only.
void KeepCorners(ConvexHull& hull, const Points& points) {
  std::map<int, int> number;
  for (const HullFace& face : hull.faces) {
    for (const int i : face.polygon) number[i] = 0;
  }
  for (auto& [source, corner] : number) {
    corner = static_cast<int>(hull.vertices.size());
    hull.vertices.push_back(points[source]);
  }
  for (HullFace& face : hull.faces) {
    for (int& i : face.polygon) i = number[i];
    for (size_t k = 2; k < face.polygon.size(); ++k) {
      hull.triangles.push_back({face.polygon[0], face.polygon[k - 1], face.polygon[k]});
    }
  }
}

/// Faces, corners and edges of a set that spans three dimensions.
void FinishSolid(ConvexHull& hull, const Points& points, const Span& span, double extent) {
  const double tolerance = kFlatness * extent;
  // Triangles in one plane become one polygon, whose normal is the mean weighted by area.
  const std::vector<std::array<int, 3>> triangles = QuickHull(points, span, tolerance).Triangles();
  for (const std::vector<int>& group : CoplanarGroups(points, triangles, extent)) {
    Vector3d normal = Vector3d::Zero();
    std::vector<int> corners;
    for (const int i : group) {
      normal += TriangleNormal(points, triangles[i]);
      corners.insert(corners.end(), triangles[i].begin(), triangles[i].end());
    }
    if (normal.norm() <= tolerance * tolerance) continue;
    normal.normalize();
    std::vector<int> polygon = PlanarHull(points, corners, normal, tolerance);
    if (polygon.size() >= 3) AddFace(hull, points, normal, std::move(polygon));
  }
  // Each edge lies between two faces, and is kept once with both normals.
  KeepCorners(hull, points);
  DirectedEdges left_of;
  for (int f = 0; f < std::ssize(hull.faces); ++f) AddEdges(hull.faces[f].polygon, f, left_of);
  for (const auto& [edge, f] : left_of) {
    const auto twin = left_of.find({edge.second, edge.first});
    if (twin == left_of.end() || edge.first > edge.second) continue;
    hull.edges.push_back(
        {edge.first, edge.second, hull.faces[f].normal, hull.faces[twin->second].normal});
  }
}

/// The same for a flat set: one polygon seen from both sides.
void FinishFlat(ConvexHull& hull, const Points& points, const Span& span, double extent) {
  const Vector3d o = points[span.index[0]];
  const Vector3d normal = (points[span.index[1]] - o).cross(points[span.index[2]] - o).normalized();
  std::vector<int> polygon = PlanarHull(points, AllOf(points), normal, kFlatness * extent);
  AddFace(hull, points, normal, polygon);
  std::reverse(polygon.begin(), polygon.end());
  AddFace(hull, points, -normal, std::move(polygon));
  KeepCorners(hull, points);
  // In the Gauss map a flat hull's rim turns from one side to the other, so each edge has two arcs,
  // split at the direction of the rim.
  const std::vector<int>& loop = hull.faces[0].polygon;
  for (size_t k = 0; k < loop.size(); ++k) {
    const int begin = loop[k];
    const int end = loop[(k + 1) % loop.size()];
    const Vector3d rim = (hull.vertices[end] - hull.vertices[begin]).cross(normal).normalized();
    hull.edges.push_back({begin, end, normal, rim});
    hull.edges.push_back({begin, end, rim, -normal});
  }
}

/// The same for a segment, whose edge has a full circle of normals: four arcs.
void FinishSegment(ConvexHull& hull, const Points& points, const Span& span) {
  hull.vertices = {points[std::min(span.index[0], span.index[1])],
                   points[std::max(span.index[0], span.index[1])]};
  const Vector3d along = (hull.vertices[1] - hull.vertices[0]).normalized();
  const Vector3d u = along.unitOrthogonal();
  const Vector3d v = along.cross(u);
  const Vector3d around[] = {u, v, -u, -v};
  for (int k = 0; k < 4; ++k) hull.edges.push_back({0, 1, around[k], around[(k + 1) % 4]});
}

/// Volume integrals of the tetrahedron (0, a, b, c): six times the volume comes from the triple
/// product, second moments from the sum of its corners.
struct Moments {
  double volume = 0.0;
  Vector3d first = Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();  ///< Integral of x xᵀ.

  void Add(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    const double six_v = a.dot(b.cross(c));
    const Vector3d sum = a + b + c;
    volume += six_v / 6.0;
    first += six_v / 24.0 * sum;
    second += six_v / 120.0 *
              (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose());
  }
};

}  // namespace

ConvexHull ComputeHull(const std::vector<Eigen::Vector3d>& points) {
  ConvexHull hull;
  if (points.empty()) return hull;
  const double extent = ExtentOfPoints(points);
  const Span span = FindSpan(points, kFlatness * extent);
  hull.dimension = span.dimension;
  if (span.dimension == 0) hull.vertices = {points[0]};
  if (span.dimension == 1) FinishSegment(hull, points, span);
  if (span.dimension == 2) FinishFlat(hull, points, span, extent);
  if (span.dimension == 3) FinishSolid(hull, points, span, extent);
  return hull;
}

MassProperties ComputeMassProperties(const ConvexHull& hull) {
  MassProperties result;
  if (hull.vertices.empty()) return result;
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& p : hull.vertices) mean += p;
  mean /= static_cast<double>(hull.vertices.size());
  result.centroid = mean;
  if (hull.dimension < 3) return result;
  // Integrated about the mean of the corners, so that a hull far from the origin loses no digits.
  Moments moments;
  for (const std::array<int, 3>& t : hull.triangles) {
    moments.Add(hull.vertices[t[0]] - mean, hull.vertices[t[1]] - mean, hull.vertices[t[2]] - mean);
  }
  if (moments.volume <= 0.0) return result;
  result.volume = moments.volume;
  const Vector3d offset = moments.first / moments.volume;
  result.centroid = mean + offset;
  // Brought to the centroid (parallel axis theorem); of second moments S the inertia is tr(S) 1 -
  // S.
  const Eigen::Matrix3d second = moments.second - moments.volume * offset * offset.transpose();
  result.inertia = second.trace() * Eigen::Matrix3d::Identity() - second;
  return result;
}

double HullVolume(const std::vector<Eigen::Vector3d>& points) {
  return ComputeMassProperties(ComputeHull(points)).volume;
}

std::vector<Eigen::Vector3d> ThickenFlat(const std::vector<Eigen::Vector3d>& points,
                                         double thickness) {
  const ConvexHull hull = ComputeHull(points);
  // The directions in which the hull has no extent.
  std::vector<Vector3d> directions;
  if (hull.dimension == 0) {
    directions = {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()};
  } else if (hull.dimension == 1) {
    const Vector3d along = (hull.vertices[1] - hull.vertices[0]).normalized();
    directions = {along.unitOrthogonal(), along.cross(along.unitOrthogonal())};
  } else if (hull.dimension == 2) {
    directions = {hull.faces[0].normal};
  }
  // Each of them doubles the points, half the thickness to either side.
  std::vector<Vector3d> result = hull.vertices;
  for (const Vector3d& direction : directions) {
    std::vector<Vector3d> wider;
    for (const Vector3d& p : result) {
      wider.push_back(p - 0.5 * thickness * direction);
      wider.push_back(p + 0.5 * thickness * direction);
    }
    result = std::move(wider);
  }
  return result;
}

}  // namespace morphbus::model
