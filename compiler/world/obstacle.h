#pragma once
// Things in the world that do not move: what the simulator, pictures and exports have beside the
// robot and the ground.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "compiler/model/robot_model.h"
#include "compiler/world/surface.h"

namespace morphbus::world {

/// The shapes that an obstacle can have.
enum class Shape { kBox, kCylinder, kSphere, kPlane, kMesh };

/// One shape that stands still. Frames: W world (NUE: +Y up, the ground at y = 0, the robot frame's
/// origin above x = z = 0 at the start), O the obstacle's own.
struct Obstacle {
  /// Model, link and collision that it comes from: "wall.link.collision".
  std::string name;
  Shape shape = Shape::kBox;
  /// Its pose: the middle of a box, cylinder or sphere, a point of a plane, the origin of a mesh. A
  /// cylinder stands along z of O, which is also where a plane faces.
  model::Pose X_WO = model::Pose::Identity();
  /// Metres. A box: its sides. A cylinder: radius and length. A sphere: radius. A plane is without
  /// end; its first two are the sides that are drawn. A mesh: 0.
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  /// Coulomb coefficient between it and the robot; that of the ground if there is none. Where the
  /// ground's is 0, which makes the robot slide on everything, it is 0 too.
  std::optional<double> friction = {};
  /// The triangles of a mesh or height map, in O (m), shared by copies; null for other shapes.
  std::shared_ptr<const TriangleMesh> mesh = {};
};

/// Corners of the obstacle in O, for pictures (m): of a cylinder or sphere a body with so many
/// sides, of a plane the rectangle that is drawn, of a mesh the corners of its triangles. But for a
/// mesh their convex hull is what is to be seen.
std::vector<Eigen::Vector3d> CornersOf(const Obstacle& obstacle);

}  // namespace morphbus::world
