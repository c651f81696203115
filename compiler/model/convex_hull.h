#pragma once
// Convex hulls of small point sets: faces for drawing and overlap tests, mass properties.

#include <Eigen/Core>
#include <array>
#include <vector>

namespace morphbus::model {

/// A planar face of a hull. For a flat hull there are two, back to back.
struct HullFace {
  /// The unit normal, which points outward.
  Eigen::Vector3d normal;
  /// The dot product of the normal with any point of the face (m).
  double offset = 0.0;
  /// Indices of the corners, counter-clockwise as seen from outside.
  std::vector<int> polygon;
};

/// An edge between two corners, with the outward normals of the faces it separates. The edges of a
/// flat hull appear twice (top and rim, rim and bottom), that of a segment four times, so that
/// every hull's normals cover the whole sphere (the Gauss map that exact overlap tests walk).
struct HullEdge {
  /// Indices of the two corners.
  int begin = 0;
  int end = 0;
  /// The unit normals of the two faces.
  Eigen::Vector3d normal_1;
  Eigen::Vector3d normal_2;
};

/// The convex hull of a point set; all coordinates are in the frame of the points (m). ComputeHull
/// makes it; without points it is empty.
struct ConvexHull {
  /// How many dimensions it extends in: -1 empty, 0 a point, 1 a segment, 2 flat, 3 a solid.
  int dimension = -1;
  /// The corners only, in the order of the source points.
  std::vector<Eigen::Vector3d> vertices;
  /// The faces, coplanar triangles merged, for dimensions 2 and 3.
  std::vector<HullFace> faces;
  /// The edges, for dimensions 1 to 3.
  std::vector<HullEdge> edges;
  /// The faces cut into triangles from their first corners: indices of corners, outward.
  std::vector<std::array<int, 3>> triangles;
};

/// Hull of `points` by quickhull (Barber, Dobkin, Huhdanpaa 1996). Points nearer than 1e-9 of the
/// set's extent count as one, and thickness below that as flat, so flat, collinear, repeated and
/// coplanar points are all handled.
ConvexHull ComputeHull(const std::vector<Eigen::Vector3d>& points);

/// Volume (m³), centroid (m) and inertia about the centroid for density 1 (m⁵), in the points'
/// frame.
struct MassProperties {
  double volume = 0.0;
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
};
/// The mass properties of `hull`. For a hull without volume all are zero but for the centroid,
/// which is the mean of the corners.
MassProperties ComputeMassProperties(const ConvexHull& hull);

/// The volume of the convex hull of `points` (m³); 0 for flat sets.
double HullVolume(const std::vector<Eigen::Vector3d>& points);

/// The corners of the hull of `points`, thickened to `thickness` (m), centred, along every
/// direction it has no extent in. A hull with volume comes back as its corners; no points as none.
/// For mass and physics only, never for pruning connections.
std::vector<Eigen::Vector3d> ThickenFlat(const std::vector<Eigen::Vector3d>& points,
                                         double thickness);

}  // namespace morphbus::model
