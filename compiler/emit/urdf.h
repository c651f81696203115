#pragma once
// URDF, the Unified Robot Description Format of ROS.

#include "compiler/emit/exported.h"
#include "compiler/emit/meshes.h"
#include "compiler/emit/robot_tree.h"

namespace morphbus::emit {

/// The tree as URDF, with meshes beside it. Every link of the robot is a URDF link of its own name
/// and with its own frame; the root "world" has z up, and "robot_frame", fixed to it, is the robot
/// frame. URDF turns a link about its own frame's origin, so a joint whose axis misses the origin
/// of its child gets a massless link "<child>.axis" on the axis before it. Takes an open tree: what
/// it leaves out is a warning and a comment with the relative pose that was lost, a joint for
/// Gazebo, and an entry of the companion file `stem`_cuts.json (urdf_cuts.h). Start values are not
/// part of the format: a warning and a comment.
Exported ToUrdf(const model::Model& model, const RobotTree& tree, const MeshPlace& place);

}  // namespace morphbus::emit
