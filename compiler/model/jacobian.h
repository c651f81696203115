#pragma once
// How fast a link moves for the rates of the robot's joints.

#include <Eigen/Core>

#include "compiler/model/forward_kinematics.h"

namespace morphbus::model {

/// The geometric Jacobian of a link at joint values `q`, which must have the robot's shape
/// (checked), as `module` and `link` must be good. It has six rows, and a column for each joint of
/// the robot, module by module in declared order: in the robot frame R the velocity of the origin
/// of the link's frame (m/s), then the link's angular velocity (rad/s), per unit of the joint's
/// rate (rad/s, or m/s of a prismatic joint). Joints between which a loop closes are taken as free,
/// as by ForwardKinematics, whose derivative this is: those that its tree does not need have zeros.
/// So have fixed joints. After K. M. Lynch, F. C. Park, Modern Robotics (2017), Sec. 5.1.
Eigen::Matrix<double, 6, Eigen::Dynamic> Jacobian(const Model& model, const Robot& robot,
                                                  const JointValues& q, int module, int link);

}  // namespace morphbus::model
