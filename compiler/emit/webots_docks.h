#pragma once
// What Webots' Connector nodes need to know and M3L says in other words.

#include <compare>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/model/robot_model.h"

namespace morphbus::emit {

/// A connector as a Connector node.
struct DockFace {
  /// Frame C in the link's frame: x out of the module, z a docking direction (m).
  model::Pose X_LC = model::Pose::Identity();
  int rotations = 1;                    ///< Ways to dock in a full turn, equally far apart; 0: any.
  std::string_view type = "symmetric";  ///< Or "active", "passive": which one locks.
  std::string model;                    ///< Connectors of one model may dock.
};

/// faces[module type][connector]
using DockFaces = std::vector<std::vector<DockFace>>;

/// Lengths that go with the size of the modules (m).
struct DockScale {
  double reach;           ///< Of connectors' radio and sense of presence: to a mate, not beyond it.
  double emitter_offset;  ///< Of a connector's emitter from its centre, along its face's z: by the
                          ///< direction in which a mate hears it, it tells how the two are turned.
  double tolerance;       ///< Within which the centres of docked faces coincide.
};

/// `reach` is 1 cm, or a third of the least distance between two connectors of one module type
/// (centres, joints at 0) if that is less; the others are fixed parts of it. One for all types, as
/// mates may be unlike.
DockScale DockScaleOf(const model::Model& model);

/// Connectors that some connection joins, directly or over others, share a model, a number of
/// rotations and docking directions that meet; they are active and passive where they fall into two
/// sides (the one with state variables, such as hooks, is active), else symmetric. The number of
/// rotations is the least that allows every way in which the model's connections join faces that
/// look at each other.
DockFaces DockFacesOf(const model::Model& model);

/// A connector of a module type, both by index.
struct DockEnd {
  int type, connector;
  friend auto operator<=>(const DockEnd&, const DockEnd&) = default;
};

/// One way of docking, as the module at one of its two ends has it.
struct DockWay {
  DockEnd own, mate;
  int connection_type;                    ///< Index into Model::connection_types.
  bool is_member_b;                       ///< This module is the connection's second member.
  const model::ConnectionOption* option;  ///< In the model, which must outlive the way.
};

/// All that a module of type `type` has, in the order of the model's connections. What joins it to
/// its like is there twice, once from either end.
std::vector<DockWay> DockWaysOf(const model::Model& model, int type);

/// Pose of the mate's face in the own one, joints at 0.
model::Pose MateFace(const DockFaces& faces, const DockWay& way);

/// Where Webots will allow what the model does not, a sentence each: pairs of connectors of one
/// model that have fewer turns to dock in than rotations, or none. One pair of connectors for each
/// two of the module types `types` (indices).
std::vector<std::string> LooseDocking(const model::Model& model, const DockFaces& faces,
                                      const std::set<int>& types);

/// Whether faces at these poses look at each other as Webots wants it to lock them; `tolerance`
/// (m) is DockScale's.
bool Aligned(const model::Pose& X_WC, const model::Pose& X_WD, int rotations, double tolerance);

}  // namespace morphbus::emit
