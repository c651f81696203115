#pragma once
// Mass, centre of mass and inertia of a link, for physics engines and exported models alike.

#include <Eigen/Core>
#include <map>
#include <utility>
#include <vector>

#include "compiler/model/robot_model.h"

namespace morphbus::model {

/// Thickness that a flat hull gets for mass and physics, as a part of its module's extent (M3L
/// reference, hulls).
inline constexpr double kFlatThickness = 0.05;

/// The acceleration of whatever falls, m/s^2, in the simulator and wherever a robot is weighed.
inline constexpr double kGravity = 9.81;

/// The mass properties of one link, in its own frame L. At joint values 0 that is the module frame.
struct LinkMass {
  double mass_kg = 0.0;       ///< At least 1 g.
  Eigen::Vector3d p_LoLcm_L;  ///< Centre of mass (m).
  Eigen::Matrix3d I_Lcm_L;    ///< Inertia about the centre of mass (kg m^2).
};

/// Mass spread evenly over the parts as SolidParts has them; where parts lie in each other, that
/// volume counts for each. The inertia of a part that is solid but thinner than 1 mm is that of its
/// bounding box, at least 1 mm thick; of a link without hull that of the box round its connectors
/// and joint axes.
LinkMass ComputeLinkMass(const ModuleType& type, int link);

/// ComputeLinkMass of a model's links, each worked out once: a robot has few kinds of links and may
/// have ten thousands of links. The model must outlive it and stay as it is. Answers stay valid as
/// long as it lives. Not for several threads.
class LinkMasses {
 public:
  explicit LinkMasses(const Model& model) : model_(model) {}
  /// Of a link by indices: of the module type, and of the link in it.
  const LinkMass& Of(int type, int link);

 private:
  const Model& model_;
  /// By type and link. A map leaves its elements where they are as it grows.
  std::map<std::pair<int, int>, LinkMass> masses_;
};

/// Corners of what a link can collide with, in the link's frame (m), each convex part by itself:
/// thickened by kFlatThickness (at least 1 mm) where it is flat. Empty for a link without hull.
std::vector<std::vector<Eigen::Vector3d>> SolidParts(const ModuleType& type, int link);

}  // namespace morphbus::model
