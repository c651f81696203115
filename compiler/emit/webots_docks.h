#pragma once
// What Webots' Connector nodes need to know and M3L says in other words.

#include <string>
#include <vector>

#include "compiler/model/robot_model.h"

namespace morphbus::emit {

/// A connector as a Connector node.
struct DockFace {
  /// Frame C in the link's frame: x out of the module, z a docking direction (m).
  model::Pose X_LC = model::Pose::Identity();
  int rotations = 0;               ///< Ways to dock in a full turn; 0: any.
  const char* type = "symmetric";  ///< Or "active", "passive": who locks.
  std::string model;               ///< Connectors of one model may dock.
};

/// faces[module type][connector]. Connectors that some connection joins, directly or over others,
/// share a model; they are active and passive where they fall into two sides (the one with state
/// variables, such as hooks, is active), else symmetric.
std::vector<std::vector<DockFace>> DockFaces(const model::Model& model);

/// Whether faces at these poses look at each other as Webots wants it to lock them.
bool Aligned(const model::Pose& X_WC, const model::Pose& X_WD, int rotations);

}  // namespace morphbus::emit
