#pragma once
// The body by which is judged how a robot walks, stands or falls.

#include <Eigen/Geometry>

#include "compiler/model/kinematic_graph.h"
#include "compiler/model/robot_model.h"

namespace morphbus::logger {

/// The body that is followed, and the point of it: `X_LP` is the pose of the point's frame P in
/// that of the link L by which WORLD names the body (m).
struct TrackedBody {
  model::LinkRef link;
  model::Pose X_LP = model::Pose::Identity();
};

/// The body that carries a link at the start values, and in it a frame P of which `X_RP` says how
/// it then lies in the robot frame (m).
TrackedBody BodyOf(const model::Model& model, const model::Robot& robot, model::LinkRef link,
                   const model::Pose& X_RP);
/// The heaviest body, the trunk of whatever walks, at its centre of mass: how a robot walks does
/// not depend on which module is root.
TrackedBody Trunk(const model::Model& model, const model::Robot& robot);

/// By how much the up axis of a body has turned away from where it was, rad: `q_0` is the body's
/// orientation in W (north, up, east) at first, `q` the one now. The same for every frame that is
/// fixed to the body.
double TiltBetween(const Eigen::Quaterniond& q_0, const Eigen::Quaterniond& q);

}  // namespace morphbus::logger
