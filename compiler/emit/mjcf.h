#pragma once
// MJCF, the model format of MuJoCo.

#include <string>

#include "compiler/emit/exported.h"
#include "compiler/emit/robot_tree.h"

namespace morphbus::emit {

/// The robot in MJCF, meshes included, free to move above a floor. Bodies have the names and frames
/// of the robot's links and hang in "robot_frame", which is free; the world has z up; qpos holds
/// the joint values as they are in M3L. The file opens at the start values, which are the keyframe
/// "start" too. Loops are kept: each is a weld with its explicit relpose; a joint that closes a
/// loop moves a body "<joint>.loop", which is welded to the link there and has half of its mass.
/// Position actuators have the joints' names and forces; damping makes the declared speed the
/// terminal one. A tree deeper than MuJoCo reads in one file goes on in files under `stem`_parts/.
Exported ToMjcf(const model::Model& model, const RobotTree& tree, const std::string& stem);

}  // namespace morphbus::emit
