#pragma once
// What a URDF file cannot hold of a robot's loops, for programs that can: Gazebo, which takes
// joints of SDF in <gazebo> elements, and any other program, by a file beside the URDF.

#include <pugixml.hpp>
#include <string>
#include <vector>

#include "compiler/emit/robot_tree.h"

namespace morphbus::emit {

/// A frame of the URDF file in which a link of M3L stays put.
struct CarryingLink {
  std::string name;  ///< Of a URDF link.
  model::Pose X_CL;  ///< M3L's link in its frame (m).
};

/// Appends the <joint> of SDF (sdf.cc) of this name by which the link `from` holds the link `to`:
/// fixed if `joint` is null. SDF counts values from where the links stand in the file, which is at
/// `at` (rad or m). `X_CL` is the pose of M3L's link in the frame of the link `to` (m), in which
/// the joint's place and axis are then written.
void AppendSdfJoint(pugi::xml_node parent, const std::string& name, const TreeJoint* joint,
                    const std::string& from, const std::string& to, double at,
                    const model::Pose& X_CL = model::Pose::Identity());

/// One <gazebo><joint> in `robot` for each loop whose opening loses something. Gazebo joins links
/// as they stand in the file, at joint values 0: where a loop is open there, a comment says so
/// instead. It also melts links held by fixed joints into the links that carry them, so joints are
/// written between those: `carrying[i]` carries the tree's link i.
void AppendGazeboJoints(const RobotTree& tree, const std::vector<CarryingLink>& carrying,
                        pugi::xml_node robot);

/// All opened loops as JSON: {"robot", "cuts": [{"name", "kind": "connection" or "joint", "loses":
/// "nothing", "a locked joint" or "a loop", "parent", "child", "pose": {"p", "q"}, ...}]}. The pose
/// (m, w x y z) is the child's in the parent, for a joint at value 0; a joint also has "type", and
/// unless that is fixed "origin", "axis" (in that common frame), "effort", "speed" and, unless
/// continuous, "lower" and "upper".
std::string CutsJson(const RobotTree& tree);

}  // namespace morphbus::emit
