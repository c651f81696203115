#pragma once
// Which edges of a robot go where a format holds trees only.

#include <vector>

#include "compiler/model/kinematic_tree.h"
#include "compiler/model/robot_model.h"

namespace morphbus::emit {

struct TreeCuts {
  model::KinematicTree::Omitted omitted;  ///< What goes, so that the links form a tree.
  /// Of the dockings that go, those whose ends other dockings of the same body still hold together:
  /// nothing is lost with them. By index into Robot::dockings.
  std::vector<bool> redundant;
  /// Joints that cannot move, by the robot's loops, by flat index. None where that is not computed
  /// (see model::KinematicGraph::locked_computed).
  std::vector<bool> locked;
};

/// Cuts each loop where least is lost: redundant dockings inside a body first, then locked joints,
/// then the docking farthest from the root link (by joints and dockings between; of equals the one
/// declared last); a joint that can move only where a module's own links form a loop.
TreeCuts CutLoops(const model::Model& model, const model::Robot& robot);

}  // namespace morphbus::emit
