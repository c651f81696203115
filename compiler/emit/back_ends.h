#pragma once
// What the back ends for other programs offer, by format. Webots has a header of its own.

#include <cstdint>
#include <string>
#include <vector>

#include "compiler/emit/exported.h"
#include "compiler/emit/meshes.h"
#include "compiler/emit/robot_tree.h"
#include "compiler/model/kinematic_graph.h"
#include "compiler/world/obstacle.h"

namespace morphbus::emit {

// URDF, the Unified Robot Description Format of ROS.

/// The tree as URDF, with meshes beside it. Every link of the robot is a URDF link of its own name
/// and with its own frame; the root "world" has z up, and "robot_frame", fixed to it, is the robot
/// frame. URDF turns a link about its own frame's origin, so a joint whose axis misses the origin
/// of its child gets a massless link "<child>.axis" on the axis before it. Takes an open tree: what
/// it leaves out is a warning and a comment with the relative pose that was lost, a joint for
/// Gazebo, and an entry of the companion file `stem`_cuts.json (urdf_cuts.h). Start values are not
/// part of the format: a warning and a comment.
Exported ToUrdf(const model::Model& model, const RobotTree& tree, const MeshPlace& place);

// SDFormat 1.9, the model format of Gazebo.

/// The robot as an SDF model, with meshes beside it under `stem`_meshes/. Links have their own
/// names and frames; the model frame is the robot frame, turned so that its y (up) is the world's
/// z. Every connection is a fixed joint, also those that close loops. SDF knows no start values:
/// its poses are those at the start, and its joint values count from there (limits are shifted).
/// With obstacles the file is a <world>: a ground, the robot, and each obstacle as a static model.
Exported ToSdf(const model::Model& model, const RobotTree& tree, const MeshPlace& place,
               const std::vector<world::Obstacle>& obstacles = {});

// MJCF, the model format of MuJoCo.

/// The robot in MJCF, meshes included, free to move above a floor. Bodies have the names and frames
/// of the robot's links and hang in "robot_frame", which is free; the world has z up; qpos holds
/// the joint values as they are in M3L. The file opens at the start values, which are the keyframe
/// "start" too. Loops are kept: each is a weld with its explicit relpose; a joint that closes a
/// loop moves a body "<joint>.loop", which is welded to the link there and has half of its mass.
/// Position actuators have the joints' names and forces; damping makes the declared speed the
/// terminal one. A tree deeper than MuJoCo reads in one file goes on in files under `stem`_parts/.
/// Obstacles are geoms of the world. MuJoCo takes a mesh for its hull, so that each triangle of one
/// is a plate of its own (triangle_plates.h).
Exported ToMjcf(const model::Model& model, const RobotTree& tree, const std::string& stem,
                const std::vector<world::Obstacle>& obstacles = {});

// Forward kinematics of a robot or module as plain C99, for microcontrollers; of a module also the
// tables that the virtual machine needs.

/// `stem`.c and, as companion, `stem`.h: enumerators of links and joints, and one function that
/// computes the poses of all links. Single precision; no memory but its arguments, no loops, no
/// library but sinf and cosf. Constants are folded: a quarter turn costs no multiplication.
Exported ToC(const RobotTree& tree, const std::string& stem);

/// The same of module type `type` (an index) alone, and with it the tables of c_tables.h. Where the
/// module exceeds what the virtual machine holds there are no tables, and a warning says why.
Exported ModuleToC(const model::Model& model, int type, uint64_t model_hash,
                   const std::string& stem);

// Graphs as pictures: Graphviz DOT.

/// The assembly (paper, Fig. 5): a box a module with its links and joints, an edge a connection,
/// labelled with connectors and number.
std::string AssemblyGraphDot(const model::Model& model, const model::Robot& robot);

/// The kinematic graph of the robot, `graph` (paper, Fig. 6): a vertex a body with its links and
/// degree, an edge a joint with its number of adjacent joints; locked joints dashed.
std::string KinematicGraphDot(const model::Model& model, const model::Robot& robot,
                              const model::KinematicGraph& graph);

// A robot as M3L text.

/// The definition of `robot`, which need not be one of `model`'s: connections by number, the frame,
/// start values that are not 0. In one line: layout is for m3l::Format. Compiled beside the model's
/// module types and connections it gives the robot back.
std::string RobotM3l(const model::Model& model, const model::Robot& robot);

}  // namespace morphbus::emit
