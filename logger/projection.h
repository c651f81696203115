#pragma once
// From the world to the picture plane: orthographic views, and faces in the order to paint them.

#include <Eigen/Core>
#include <vector>

#include "logger/drawing.h"

namespace morphbus::logger {

/// An orthographic view. The picture plane has u to the right, v up; depth grows towards the
/// viewer.
class Projection {
 public:
  explicit Projection(View view);

  /// (u, v, depth) of a point in the world (m).
  [[nodiscard]] Eigen::Vector3d Project(const Eigen::Vector3d& p_W) const { return R_ * p_W; }
  /// The same for a direction.
  [[nodiscard]] Eigen::Vector3d Direction(const Eigen::Vector3d& d_W) const { return R_ * d_W; }
  /// True if the ground y = 0 is seen as a line.
  [[nodiscard]] bool sees_ground_edge_on() const { return edge_on_; }
  /// The point of the ground that is seen at (u, v); only where it is not seen edge on.
  [[nodiscard]] Eigen::Vector3d GroundPointAt(double u, double v) const;

 private:
  Eigen::Matrix3d R_;  ///< Rows: right, up, towards the viewer, in the world frame.
  bool edge_on_ = false;
};

/// A face as it is painted.
struct VisibleFace {
  std::vector<Eigen::Vector2d> outline;  ///< On the picture plane (m).
  Color color;                           ///< Shaded.
  double depth = 0;                      ///< Of its centre.
};

/// The faces of a scene that look at the viewer, shaded, farthest first (painter's algorithm: hulls
/// are ordered by planes that separate them where there are such, faces within a hull never
/// overlap).
std::vector<VisibleFace> VisibleFaces(const Scene& scene, const Projection& projection);

}  // namespace morphbus::logger
