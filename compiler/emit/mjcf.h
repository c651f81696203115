#pragma once
// MJCF, the model format of MuJoCo.

#include "compiler/emit/exported.h"
#include "compiler/emit/robot_tree.h"

namespace morphbus::emit {

/// The robot as one MJCF file, meshes included, free to move above a floor. Bodies have the names
/// and frames of the robot's links and hang in "robot_frame", which is free; the world has z up;
/// qpos holds the joint values as they are in M3L, and the keyframe "start" the start values. Loops
/// are kept: each is a weld with its explicit relpose; a joint that closes a loop gets a near
/// massless body
/// "<joint>.loop" that is welded on. Position actuators have the joints' names; MJCF has no limit
/// of speed, so each is damped to reach its speed at about a tenth of its torque.
Exported ToMjcf(const model::Model& model, const RobotTree& tree);

}  // namespace morphbus::emit
