#pragma once
// Masses, solid hulls and looks of links, each worked out once: a robot has few kinds of links and
// may have ten thousands of links.

#include <Eigen/Core>
#include <map>
#include <utility>
#include <vector>

#include "compiler/emit/meshes.h"
#include "compiler/model/convex_hull.h"
#include "compiler/model/link_mass.h"
#include "compiler/model/robot_model.h"

namespace morphbus::emit {

/// model::ComputeLinkMass, model::SolidParts and LooksOf of a model's links, remembered. The model
/// must outlive it and stay as it is. Answers stay valid as long as it lives. Not for several
/// threads.
class LinkSolids {
 public:
  /// Works out nothing yet: each answer is found when it is first asked for.
  explicit LinkSolids(const model::Model& model) : model_(model), masses_(model) {}

  /// Mass, centre of mass and inertia in the link's frame. `type` and `link` are indices of a
  /// module type and of a link in it, here and below.
  const model::LinkMass& Mass(int type, int link) { return masses_.Of(type, link); }
  /// Corners of what the link can collide with, in its frame (m), for each of its convex parts;
  /// empty without hull.
  const std::vector<std::vector<Eigen::Vector3d>>& Parts(int type, int link);
  /// The same parts with the faces between their corners, for formats that hold them:
  /// model::ComputeHull of each.
  const std::vector<model::ConvexHull>& Faces(int type, int link);
  /// How the link looks: LooksOf.
  const std::vector<LookMesh>& Looks(int type, int link);

 private:
  const model::Model& model_;
  model::LinkMasses masses_;
  /// Answers so far, by module type and link. A map leaves its elements where they are as it grows,
  /// so that references to them stay good.
  std::map<std::pair<int, int>, std::vector<std::vector<Eigen::Vector3d>>> parts_;
  std::map<std::pair<int, int>, std::vector<model::ConvexHull>> faces_;
  std::map<std::pair<int, int>, std::vector<LookMesh>> looks_;
};

}  // namespace morphbus::emit
