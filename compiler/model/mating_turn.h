#pragma once
// By which turn about the face of a connector two ways of mating a pair of connectors differ.

#include <optional>

#include "compiler/model/robot_model.h"

namespace morphbus::model {

/// The line along which a connector faces its partner.
struct FaceNormal {
  /// A unit vector in the module frame M.
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  /// True if `direction` leads out of the module; false if nothing says which of the two ways does.
  bool outward = false;
};

/// A turn by which two options of one pair of connectors differ.
struct MatingTurn {
  /// Right-handed about the outward normal, in (-180, 180]. Turning b so about the normal of a's
  /// connector is turning a so about that of b's: to whoever looks at either face, the other module
  /// turns anticlockwise.
  double degrees = 0.0;
  bool signed_ = true;  ///< False: the way out is not known, and the sign means nothing.
};

/// The motion of member b from one option to another, in a's frame, if it leaves member a's
/// connector where it is, to 1e-6 of `extent_m`: it is a turn then.
std::optional<Eigen::AngleAxisd> TurnOfOption(const ModuleType& type_a, double extent_m,
                                              const ConnectionOption& from,
                                              const ConnectionOption& to);

/// The turn of member b from option `from` to option `to`, about `normal` of member a's connector;
/// nothing if the two differ by anything else.
std::optional<MatingTurn> TurnBetween(const ModuleType& type_a, double extent_m,
                                      const FaceNormal& normal, const ConnectionOption& from,
                                      const ConnectionOption& to);

}  // namespace morphbus::model
