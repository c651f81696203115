#pragma once
// Mass, inertia and collision hull of one link of a module type, in the link's frame.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "compiler/model/robot_model.h"

namespace morphbus::sim {

/// How much smaller than its hull a link is for the engine, on every side (m): the paper's hulls
/// touch all the time, and with exact ones the robot jams.
inline constexpr double kHullShrink = 1e-3;

/// Margin that the engine adds round every shape (m). The hulls given to it are smaller by this.
inline constexpr double kCollisionMargin = 0.5e-3;

struct LinkPhysics {
  double mass_kg = 0.0;       ///< At least 1 g.
  Eigen::Vector3d p_LoLcm_L;  ///< Centre of mass (m).
  Eigen::Matrix3d I_Lcm_L;    ///< Inertia about the centre of mass (kg m^2).
  /// The corners of each convex part, shrunk for collisions; empty without hull.
  std::vector<std::vector<Eigen::Vector3d>> cores_L;
  std::optional<double> friction;  ///< Its own Coulomb coefficient; absent: that of the world.
};

/// The inertia of a part thinner than 1 mm is that of its bounding box, at least 1 mm thick; for
/// collisions a flat one is thickened to 0.05 of the module's extent. A link without hull has the
/// inertia of the box round its connectors and joint axes, and nothing to collide with.
LinkPhysics ComputeLinkPhysics(const model::ModuleType& type, int link);

/// All links of the module types that a robot has, [module type][link]; of other types none.
using LinkPhysicsTable = std::vector<std::vector<LinkPhysics>>;
LinkPhysicsTable ComputeLinkPhysics(const model::Model& model, const model::Robot& robot);

/// Corners of the hull of `points` with every face moved inwards by `depth` (m), or by half of the
/// way to the centroid where the hull is thinner than that. Empty for a hull without volume.
std::vector<Eigen::Vector3d> ShrinkHull(const std::vector<Eigen::Vector3d>& points, double depth);

}  // namespace morphbus::sim
