#include "compiler/model/jacobian.h"

#include <vector>

#include "compiler/base/check.h"
#include "compiler/model/kinematic_tree.h"

namespace morphbus::model {

Eigen::Matrix<double, 6, Eigen::Dynamic> Jacobian(const Model& model, const Robot& robot,
                                                  const JointValues& q, int module, int link) {
  const KinematicTree tree(model, robot);
  const std::vector<double> flat_q = FlatValues(model, robot, q);
  std::vector<Pose> X_RL(tree.num_links());
  tree.Evaluate(flat_q.data(), X_RL.data());
  std::vector<const KinematicTree::Step*> step_of(tree.num_links());
  for (const KinematicTree::Step& step : tree.steps()) step_of[step.link] = &step;

  // Only the joints between the link and the root of its tree move it: they are met on the way up.
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian =
      Eigen::Matrix<double, 6, Eigen::Dynamic>::Zero(6, tree.num_joints());
  const int target = tree.LinkIndex(module, link);
  const Eigen::Vector3d p_RL = X_RL[target].translation();
  for (int at = target; at >= 0; at = step_of[at]->parent) {
    const KinematicTree::Step& step = *step_of[at];
    if (step.joint < 0 || step.parent < 0 || step.kind == KinematicTree::Kind::kFixed) continue;
    // A turn about an axis of the frame itself has its direction in its kind, and its sense in the
    // sign alone.
    const int own_axis =
        static_cast<int>(step.kind) - static_cast<int>(KinematicTree::Kind::kTurnX);
    const Eigen::Vector3d axis_P = own_axis >= 0 && own_axis < 3
                                       ? Eigen::Vector3d(Eigen::Vector3d::Unit(own_axis))
                                       : step.axis;
    const Pose& X_RP = X_RL[step.parent];
    const Eigen::Vector3d axis_R = step.sign * (X_RP.linear() * axis_P);
    if (step.kind == KinematicTree::Kind::kSlide) {
      jacobian.col(step.joint).head<3>() = axis_R;
    } else {
      jacobian.col(step.joint).head<3>() = axis_R.cross(p_RL - X_RP * step.origin);
      jacobian.col(step.joint).tail<3>() = axis_R;
    }
  }
  return jacobian;
}

}  // namespace morphbus::model
