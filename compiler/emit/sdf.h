#pragma once
// SDFormat 1.9, the model format of Gazebo, whose joints URDF files hold too where URDF itself
// cannot say something.

#include <pugixml.hpp>
#include <string>

#include "compiler/emit/exported.h"
#include "compiler/emit/meshes.h"
#include "compiler/emit/robot_tree.h"

namespace morphbus::emit {

/// The robot as an SDF model, with meshes beside it under `stem`_meshes/. Links have their own
/// names and frames; the model frame is the robot frame, turned so that its y (up) is the world's
/// z. Every connection is a fixed joint, also those that close loops. SDF knows no start values:
/// its poses are those at the start, and its joint values count from there (limits are shifted).
Exported ToSdf(const model::Model& model, const RobotTree& tree, const MeshPlace& place);

/// Appends the joint of this name by which the link `from` holds the link `to`: fixed if `joint` is
/// null. SDF counts values from where the links stand in the file, which is at `at` (rad or m).
/// `X_CL` is the pose of M3L's link in the frame of the link `to` (m), in which the joint's place
/// and axis are then written.
void AppendSdfJoint(pugi::xml_node parent, const std::string& name, const TreeJoint* joint,
                    const std::string& from, const std::string& to, double at,
                    const model::Pose& X_CL = model::Pose::Identity());

}  // namespace morphbus::emit
