#pragma once
// A robot as the back ends for other programs see it: named links in a tree, and where loops close.
//
// Frames: R robot frame, L link, P the link it hangs from. Link frames are M3L's own, so that at
// joint values 0 all links of a module have the same pose.

#include <string>
#include <vector>

#include "compiler/model/link_mass.h"
#include "compiler/model/robot_model.h"

namespace morphbus::emit {

/// A link of the tree, and what it hangs from.
struct TreeLink {
  std::string name;  ///< "m1.active_block"; only the link's name if the tree is a module type.
  int module = 0;    ///< Index into Robot::modules.
  int type = 0;      ///< Index into Model::module_types.
  int link = 0;      ///< Index of the link in its module type.
  /// Index of the link P that it hangs from, which stands before this one; -1: the robot frame.
  int parent = -1;
  /// Index into RobotTree::joints of the joint that holds it; -1 where a connection does.
  int joint = -1;
  /// Name of what holds it: the joint's, or "m1.c2-m2.c5" for a connection; empty for roots.
  std::string held_by;
  /// Pose of the link in P at joint value 0 (m).
  model::Pose X_PL = model::Pose::Identity();
};

/// What the model says of a link of the tree.
inline const model::Link& LinkOf(const model::Model& model, const TreeLink& link) {
  return model.module_types[link.type].links[link.link];
}

/// A joint of the robot, whether it places a link of the tree or closes a loop.
struct TreeJoint {
  std::string name;  ///< "m1.joint_1"
  model::JointType type = model::JointType::kRevolute;
  /// Index of the link that it places; -1: the joint closes a loop instead.
  int child = -1;
  /// A point on the axis (m). It has the same coordinates in P and in L, since the frames coincide
  /// at joint value 0.
  Eigen::Vector3d origin;
  Eigen::Vector3d axis;  ///< Unit; a positive value turns or slides the child along it.
  double lower = 0.0;    ///< rad or m; infinite for continuous joints.
  double upper = 0.0;
  double effort = 0.0;  ///< N·m or N.
  double speed = 0.0;   ///< rad/s or m/s.
  /// The value at which the robot begins (rad or m).
  double start = 0.0;
  /// Whether loops of the robot keep it from moving; known in open trees only.
  bool locked = false;
};

/// Where the tree does not hold but the robot does: `to` is held by `from`.
struct TreeLoop {
  /// What the tree loses: a freedom that closing the loop would take; nothing, since other
  /// connections of the body hold both links; little, since the joint is locked by loops.
  enum class Loss { kLoop, kNothing, kLockedJoint };
  std::string name;  ///< "m3.c6-m5.c3", or the joint's.
  int from = 0;      ///< Indices of links.
  int to = 0;
  int joint = -1;  ///< Index into joints; -1 for a connection.
  /// Pose of the link `to` (T) in the link `from` (F) at joint value 0 (m).
  model::Pose X_FT = model::Pose::Identity();
  Loss loss = Loss::kLoop;
};

/// A robot as a tree: plain data, which TreeOf or OpenTreeOf makes for one export. Links, joints
/// and loops refer to each other by index.
struct RobotTree {
  /// The robot's name, or the module type's.
  std::string name;
  std::vector<TreeLink> links;    ///< Each after its parent.
  std::vector<TreeJoint> joints;  ///< Modules in order, each with its joints as declared.
  std::vector<TreeLoop> loops;
};

/// The tree of a robot, breadth first from the link that carries the robot frame: the tree by which
/// `morphbus fk` computes poses.
RobotTree TreeOf(const model::Model& model, const model::Robot& robot);
/// The tree for formats that hold nothing else: loops are open where least is lost:
/// redundant dockings inside a body first, then locked joints, then the docking farthest from the
/// root link.
RobotTree OpenTreeOf(const model::Model& model, const model::Robot& robot);

/// A module type alone as a robot: its first link is the root, the module frame the robot frame. In
/// its tree links and joints have the names of the module type.
model::Robot ModuleAsRobot(const model::Model& model, int type);

/// The least y of the robot's hulls in the robot frame at the start values (m); 0 without hulls.
double LowestPoint(const model::Model& model, const RobotTree& tree);

/// How high above the floor that point is where a world has a floor (m): no contact at the start.
constexpr double kFloorClearance = 0.5e-3;

/// Poses of the links in the robot frame at the joints' start values (m), by index of link.
std::vector<model::Pose> StartPoses(const RobotTree& tree);

/// X_WR of the robot frame (y up) in a world whose z is up: a quarter turn about their common x.
model::Pose RobotFrameInZUp();

/// Motion of the child relative to its place at joint value 0, in P's frame.
model::Pose MotionOf(const TreeJoint& joint, double q);

/// Pose of a link in P at its joint's start value; `X_PL` is that at 0, `joint` -1 where none holds
/// it.
model::Pose StartInParent(const RobotTree& tree, const model::Pose& X_PL, int joint);

/// Whether the joint's axis misses the link frame's origin, so that formats whose joints turn about
/// the child frame's origin need a frame on the axis.
bool AxisIsOffOrigin(const TreeJoint& joint);

}  // namespace morphbus::emit
