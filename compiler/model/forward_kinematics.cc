#include "compiler/model/forward_kinematics.h"

#include <algorithm>
#include <deque>

#include "compiler/base/check.h"
#include "compiler/model/kinematic_tree.h"

namespace morphbus::model {

JointValues StartValues(const Robot& robot) {
  // A module's start values have a value for every joint of its type.
  JointValues q;
  q.reserve(robot.modules.size());
  for (const ModuleInstance& module : robot.modules) q.push_back(module.start);
  return q;
}

std::vector<double> FlatValues(const Model& model, const Robot& robot, const JointValues& q) {
  MORPHBUS_CHECK(q.size() == robot.modules.size());
  std::vector<double> flat;
  for (size_t m = 0; m < q.size(); ++m) {
    MORPHBUS_CHECK(q[m].size() == model.TypeOf(robot, static_cast<int>(m)).joints.size());
    flat.insert(flat.end(), q[m].begin(), q[m].end());
  }
  return flat;
}

Pose JointMotion(const Joint& joint, double q) {
  Pose X_BA = Pose::Identity();
  if (joint.type == JointType::kPrismatic) {
    X_BA.translation() = q * joint.axis;
  } else if (joint.type != JointType::kFixed) {
    // A turn about an axis that does not go through the origin moves the origin too.
    const Eigen::Matrix3d R = Eigen::AngleAxisd(q, joint.axis).toRotationMatrix();
    X_BA.linear() = R;
    X_BA.translation() = joint.p_MoJo_M - R * joint.p_MoJo_M;
  }
  return X_BA;
}

std::vector<Pose> LinkPoses(const ModuleType& type, const std::vector<double>& q, int root_link) {
  MORPHBUS_CHECK(q.size() == type.joints.size());
  std::vector<Pose> X_ML(type.links.size(), Pose::Identity());
  std::vector<bool> placed(type.links.size(), false);
  // Breadth first from the root link; each joint carries one of its links from the other.
  std::deque<int> queue = {root_link};
  placed[root_link] = true;
  while (!queue.empty()) {
    const int at = queue.front();
    queue.pop_front();
    for (size_t j = 0; j < type.joints.size(); ++j) {
      const Joint& joint = type.joints[j];
      if (joint.link_a != at && joint.link_b != at) continue;
      const int other = joint.link_b == at ? joint.link_a : joint.link_b;
      if (placed[other]) continue;
      const Pose X_BA = JointMotion(joint, q[j]);
      // The motion is that of A seen from B; where A is known, B follows by its inverse.
      X_ML[other] = X_ML[at] * (joint.link_b == at ? X_BA : X_BA.inverse());
      placed[other] = true;
      queue.push_back(other);
    }
  }
  return X_ML;
}

KinematicState ForwardKinematics(const Model& model, const Robot& robot, const JointValues& q) {
  // The tree is built anew for each call; callers that need many poses keep one (kinematic_tree.h).
  const KinematicTree tree(model, robot);
  // The tree numbers links and joints of all modules in one row; values go in and poses come out in
  // that order.
  const std::vector<double> flat_q = FlatValues(model, robot, q);
  std::vector<Pose> flat(tree.num_links());
  tree.Evaluate(flat_q.data(), flat.data());

  // The poses are handed out by module again.
  KinematicState state;
  for (size_t m = 0; m < q.size(); ++m) {
    const auto first = flat.begin() + tree.LinkIndex(static_cast<int>(m), 0);
    const size_t links = model.TypeOf(robot, static_cast<int>(m)).links.size();
    state.X_RL.emplace_back(first, first + static_cast<std::ptrdiff_t>(links));
  }
  state.num_loops = static_cast<int>(tree.loops().size());
  // How far the loops fail to close.
  for (const KinematicTree::Loop& loop : tree.loops()) {
    const auto [gap_m, gap_rad] = KinematicTree::Gap(loop, flat_q.data(), flat.data());
    state.closure_m = std::max(state.closure_m, gap_m);
    state.closure_rad = std::max(state.closure_rad, gap_rad);
  }
  return state;
}

}  // namespace morphbus::model
