#pragma once
// URDF, the Unified Robot Description Format of ROS.

#include <string>

#include "compiler/emit/exported.h"
#include "compiler/emit/robot_tree.h"

namespace morphbus::emit {

/// The tree as URDF, with meshes beside it under `stem`_meshes/. Every link of the robot is a URDF
/// link of its own name and with its own frame; the root "world" has z up, and "robot_frame", fixed
/// to it, is the robot frame. URDF turns a link about its own frame's origin, so a joint whose axis
/// misses the origin of its child gets a massless link "<child>.axis" on the axis before it. Takes
/// an open tree: what it leaves out is a warning and a comment with the relative pose that was
/// lost. Start values are not part of the format.
Exported ToUrdf(const model::Model& model, const RobotTree& tree, const std::string& stem);

}  // namespace morphbus::emit
