#pragma once
// Forward kinematics of an assembly, breadth first from the root link over joints and dockings.

#include <vector>

#include "compiler/model/robot_model.h"

namespace morphbus::model {

/// Joint values of a whole robot: values[module][joint], rad or m, declaration order.
using JointValues = std::vector<std::vector<double>>;

/// Start values of every joint, as the robot declares them.
JointValues StartValues(const Robot& robot);

/// The same values in one row: modules in order, each with its joints in order. `q` must have the
/// robot's shape (checked).
std::vector<double> FlatValues(const Model& model, const Robot& robot, const JointValues& q);

/// Pose of link A relative to link B's frame motion: Trans(o)*Rot(axis,q)*Trans(-o) (or a slide).
/// The one place where a joint's motion is written down.
Pose JointMotion(const Joint& joint, double q);

/// X_ML for each link of a module type, with link `root_link`'s frame as M; shape (links).
std::vector<Pose> LinkPoses(const ModuleType& type, const std::vector<double>& q, int root_link);

/// Where all links of a robot are at one set of joint values, and how well its loops close.
struct KinematicState {
  /// X_RL[module][link]: pose of each link in the robot frame (m).
  std::vector<std::vector<Pose>> X_RL;
  /// Largest gap over all loops (m, rad): docked frames against what the tree says.
  double closure_m = 0.0;
  double closure_rad = 0.0;
  /// Independent loops of the assembly, closed by a docking or by a joint.
  int num_loops = 0;
};

/// All link poses at joint values `q`. `q` must have the robot's shape (checked).
KinematicState ForwardKinematics(const Model& model, const Robot& robot, const JointValues& q);

}  // namespace morphbus::model
