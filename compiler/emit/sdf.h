#pragma once
// SDFormat 1.9, the model format of Gazebo.

#include "compiler/emit/exported.h"
#include "compiler/emit/meshes.h"
#include "compiler/emit/robot_tree.h"

namespace morphbus::emit {

/// The robot as an SDF model, with meshes beside it under `stem`_meshes/. Links have their own
/// names and frames; the model frame is the robot frame, turned so that its y (up) is the world's
/// z. Every connection is a fixed joint, also those that close loops. SDF knows no start values:
/// its poses are those at the start, and its joint values count from there (limits are shifted).
Exported ToSdf(const model::Model& model, const RobotTree& tree, const MeshPlace& place);

}  // namespace morphbus::emit
