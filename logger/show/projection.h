#pragma once
// From the world to the picture plane: orthographic views, and faces in the order to paint them.
// View coordinates V are (u, v, depth), metres.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "logger/show/drawing.h"

namespace morphbus::logger {

/// An orthographic view. The picture plane has u to the right, v up; depth grows towards the
/// viewer.
class Projection {
 public:
  /// The view with the world's origin at u = v = depth = 0.
  explicit Projection(View view);

  /// (u, v, depth) of a point in the world (m).
  [[nodiscard]] Eigen::Vector3d Project(const Eigen::Vector3d& p_W) const { return R_ * p_W; }
  /// The same for a direction, which keeps its length.
  [[nodiscard]] Eigen::Vector3d Direction(const Eigen::Vector3d& d_W) const { return R_ * d_W; }
  /// True if the ground y = 0 is seen as a line, that is in side views.
  [[nodiscard]] bool sees_ground_edge_on() const { return edge_on_; }
  /// The point of the ground (m, in W) that is seen at (u, v). Only for views that do not see the
  /// ground edge on: there no single point is seen.
  [[nodiscard]] Eigen::Vector3d GroundPointAt(double u, double v) const;

 private:
  /// R_VW: its rows are right, up and towards the viewer, in the world frame.
  Eigen::Matrix3d R_;
  bool edge_on_ = false;
};

/// A face as it is painted: a convex polygon that looks at the viewer.
struct VisibleFace {
  /// Its corners on the picture plane, (u, v) in metres.
  std::vector<Eigen::Vector2d> outline;
  /// For each corner whether the side from it to the next one is drawn as an edge: where the body
  /// bends sharply, and where it ends as it is seen.
  std::vector<bool> edges;
  /// Color of its hull, shaded by how the face lies to the light.
  Color color;
  /// Mean depth of its corners (m); faces of one hull are painted in this order.
  double depth = 0;
  /// SceneHull::owner of its hull: the module that is seen there.
  int owner = 0;
};

/// The faces of a scene that look at the viewer, shaded, farthest first: painting them in this
/// order covers what is hidden (painter's algorithm). Hulls are ordered by planes that separate
/// them where there are such, else by depth; faces within a convex hull never overlap. A hull that
/// lies wholly within another one is left out. Hulls that cover each other in a ring cannot be
/// ordered, and are painted by depth.
std::vector<VisibleFace> VisibleFaces(const Scene& scene, const Projection& projection);

/// Whether a point of the picture plane (m) lies in a face.
bool Covers(const VisibleFace& face, const Eigen::Vector2d& p);
/// SceneHull::owner of what is seen at a point of the picture plane (m); nothing where no body is.
std::optional<int> OwnerAt(const std::vector<VisibleFace>& faces, const Eigen::Vector2d& p);

}  // namespace morphbus::logger
