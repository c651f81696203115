#pragma once
// Things in the world that do not move: what the simulator, pictures and exports have beside the
// robot and the ground.

#include <optional>
#include <string>
#include <vector>

#include "compiler/model/robot_model.h"

namespace morphbus::world {

/// The shapes that an obstacle can have.
enum class Shape { kBox, kCylinder, kSphere, kPlane };

/// One shape that stands still. Frames: W world (NUE: +Y up, the ground at y = 0, the robot frame's
/// origin above x = z = 0 at the start), O the obstacle's own.
struct Obstacle {
  /// Model, link and collision that it comes from: "wall.link.collision".
  std::string name;
  Shape shape = Shape::kBox;
  /// Its pose: the middle of a box, cylinder or sphere, a point of a plane. A cylinder stands along
  /// z of O, which is also where a plane faces.
  model::Pose X_WO = model::Pose::Identity();
  /// Metres. A box: its sides. A cylinder: radius and length. A sphere: radius. A plane is without
  /// end; its first two are the sides that are drawn.
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  /// Coulomb coefficient between it and the robot; that of the ground if there is none.
  std::optional<double> friction = {};
};

/// Corners of the obstacle in O, for pictures (m): of a cylinder or sphere a body with so many
/// sides, of a plane the rectangle that is drawn.
std::vector<Eigen::Vector3d> CornersOf(const Obstacle& obstacle);

}  // namespace morphbus::world
