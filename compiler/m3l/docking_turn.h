#pragma once
// The turns that `rot=` counts: from the default of a pair of connectors to another of its
// connections, about the outward normal of member a's connector. Internal to check_docking.cc.

#include <optional>
#include <vector>

#include "compiler/m3l/checker.h"

namespace morphbus::m3l::internal {

/// The line along which a connector faces its partner.
struct FaceNormal {
  /// A unit vector in the module frame M.
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  /// True if `direction` leads out of the module; false if nothing says which of the two ways does.
  bool outward = false;
};

/// The outward normal of connector `index`: its `normal=`; else the normal of the plane of its
/// sub-points (with its centre if they lie on one line); if they span no plane (a key on the axis,
/// say), the axis about which the first of `options` that differ by a turn of the connector alone
/// do so. It points away from the middle of the hull of its link, or where that lies in the plane,
/// from the mean of all points of the link, or else of the module. Nothing if there is no line.
/// `options` are ways to mate the connector as member a's.
std::optional<FaceNormal> NormalOf(const CheckedModule& module, int index,
                                   const std::vector<const model::ConnectionOption*>& options);

/// A turn by which two options of one pair of connectors differ.
struct DockingTurn {
  double degrees = 0.0;  ///< Right-handed about the outward normal, in (-180, 180].
  bool signed_ = true;   ///< False: the way out is not known, and the sign means nothing.
};

/// The turn of member b from option `from` to option `to`, about `normal` of member a's connector;
/// nothing if the two differ by anything else.
std::optional<DockingTurn> TurnBetween(const CheckedModule& module_a, const FaceNormal& normal,
                                       const model::ConnectionOption& from,
                                       const model::ConnectionOption& to);

}  // namespace morphbus::m3l::internal
