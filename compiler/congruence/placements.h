#pragma once
// The ways in which a module can stand in for another of its type: as it is, turned round, its
// joints exchanged. Internal to variants.cc.

#include <Eigen/Core>
#include <vector>

#include "compiler/congruence/congruence.h"
#include "compiler/model/robot_model.h"

namespace morphbus::congruence {

/// A congruence of a module type with itself.
struct Placement {
  std::vector<int> body_of;  ///< [link]; links that fixed joints hold together are one body.
  std::vector<int> body_to;  ///< By body: the body that it stands in for.
  /// By body: the rotation that takes coordinates in the frame of the body's links to coordinates
  /// in that of the image's links. Both frames have the module's origin.
  std::vector<Eigen::Matrix3d> C;
  std::vector<JointImage> joints;  ///< By joint, `to` among all joints; fixed ones stay.
};

/// The placements of a module type of `model`, the identity first, then those first that need the
/// fewest offsets. Where a turn is free (a wheel about its own axis), there is one placement for
/// each turn that takes some connector to the place of another. Of placements that differ only in
/// bodies without connectors (wheels exchanged) the first is given.
std::vector<Placement> PlacementsOf(const model::Model& model, int type);

}  // namespace morphbus::congruence
