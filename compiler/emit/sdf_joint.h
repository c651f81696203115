#pragma once
// The element <joint> of SDF, which URDF files hold too, for Gazebo, where URDF itself cannot say
// something.

#include <pugixml.hpp>
#include <string>

#include "compiler/emit/robot_tree.h"

namespace morphbus::emit {

/// Appends the joint of this name by which the link `from` holds the link `to`: fixed if `joint` is
/// null. SDF counts values from where the links stand in the file, which is at `at` (rad or m).
/// `X_CL` is the pose of M3L's link in the frame of the link `to` (m), in which the joint's place
/// and axis are then written.
void AppendSdfJoint(pugi::xml_node parent, const std::string& name, const TreeJoint* joint,
                    const std::string& from, const std::string& to, double at,
                    const model::Pose& X_CL = model::Pose::Identity());

}  // namespace morphbus::emit
