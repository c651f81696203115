#pragma once
// Convex hulls of small point sets: faces for drawing and overlap tests, mass properties.

#include <Eigen/Core>
#include <array>
#include <vector>

namespace morphbus::model {

/// A planar face of a hull. For a flat hull there are two, back to back.
struct HullFace {
  Eigen::Vector3d normal;    ///< Unit, outward.
  double offset = 0.0;       ///< normal · x for points of the face (m).
  std::vector<int> polygon;  ///< Corner indices, counter-clockwise seen from outside.
};

/// An edge between two corners, with the outward normals of the faces it separates. The edges of a
/// flat hull appear twice (top and rim, rim and bottom), that of a segment four times, so that
/// every hull's normals cover the whole sphere (the Gauss map that exact overlap tests walk).
struct HullEdge {
  int begin = 0;
  int end = 0;
  Eigen::Vector3d normal_1;
  Eigen::Vector3d normal_2;
};

/// The convex hull of a point set. Empty for no points.
struct ConvexHull {
  int dimension = -1;                     ///< -1 empty, 0 a point, 1 a segment, 2 flat, 3 a solid.
  std::vector<Eigen::Vector3d> vertices;  ///< Corners only, in order of the source points.
  std::vector<HullFace> faces;            ///< Coplanar triangles merged. dimension 2 and 3.
  std::vector<HullEdge> edges;            ///< dimension 1 to 3.
  std::vector<std::array<int, 3>> triangles;  ///< The faces as fans; outward, into `vertices`.
};

/// Hull of `points` by quickhull (Barber, Dobkin, Huhdanpaa 1996). Points nearer than 1e-9 of the
/// set's extent count as one, and thickness below that as flat, so flat, collinear, repeated and
/// coplanar points are all handled.
ConvexHull ComputeHull(const std::vector<Eigen::Vector3d>& points);

/// Volume (m³), centroid (m) and inertia about the centroid for density 1 (m⁵), in the points'
/// frame. All zero (the centroid: mean of the corners) for a hull without volume.
struct MassProperties {
  double volume = 0.0;
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
};
MassProperties ComputeMassProperties(const ConvexHull& hull);

/// Volume of the convex hull of `points` (m³); 0 for flat sets.
double HullVolume(const std::vector<Eigen::Vector3d>& points);

/// The corners of the hull of `points`, thickened to `thickness` (m), centred, along every
/// direction it has no extent in. A hull with volume comes back as its corners; no points as none.
/// For mass and physics only, never for pruning connections.
std::vector<Eigen::Vector3d> ThickenFlat(const std::vector<Eigen::Vector3d>& points,
                                         double thickness);

}  // namespace morphbus::model
