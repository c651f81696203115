#include "compiler/model/kinematic_tree.h"

#include <cmath>
#include <deque>

namespace morphbus::model {
namespace {

using Eigen::Vector3d;

/// R * Rot(axis, q) where the axis is the frame's own x, y or z: two columns change.
template <int kAxis>
void TurnColumns(const Eigen::Matrix3d& R, double s, double c, Eigen::Matrix3d& out) {
  constexpr int kU = (kAxis + 1) % 3;
  constexpr int kV = (kAxis + 2) % 3;
  out.col(kAxis) = R.col(kAxis);
  out.col(kU) = c * R.col(kU) + s * R.col(kV);
  out.col(kV) = c * R.col(kV) - s * R.col(kU);
}

/// The angle of a rotation (rad), without sign.
double AngleOf(const Eigen::Matrix3d& R) { return std::abs(Eigen::AngleAxisd(R).angle()); }

}  // namespace

KinematicTree::KinematicTree(const Model& model, const Robot& robot, const Omitted& omitted) {
  // Flat indices: modules in order, each with its links and joints in order.
  int num_links = 0;
  for (const ModuleInstance& module : robot.modules) {
    const ModuleType& type = model.module_types[module.type];
    first_link_.push_back(num_links);
    first_joint_.push_back(num_joints_);
    num_links += static_cast<int>(type.links.size());
    num_joints_ += static_cast<int>(type.joints.size());
  }
  // The dockings at each link, so that the tree can grow over them.
  dockings_at_.resize(num_links);
  for (size_t d = 0; d < robot.dockings.size(); ++d) {
    const Docking& docking = robot.dockings[d];
    const int link_a = LinkIndex(docking.module_a, model.EndA(robot, docking).link);
    const int link_b = LinkIndex(docking.module_b, model.EndB(robot, docking).link);
    dockings_at_[link_a].push_back(static_cast<int>(d));
    dockings_at_[link_b].push_back(static_cast<int>(d));
  }
  placed_.assign(num_links, false);
  used_docking_.assign(robot.dockings.size(), false);
  used_joint_.assign(num_joints_, false);
  steps_.reserve(num_links);
  if (num_links == 0) return;
  // The robot's own tree first. Whatever it does not reach starts further trees.
  Grow(model, robot, omitted, robot.root_module, robot.root_link, robot.X_LR.inverse());
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    const size_t links = model.module_types[robot.modules[m].type].links.size();
    for (size_t l = 0; l < links; ++l) {
      Grow(model, robot, omitted, static_cast<int>(m), static_cast<int>(l), Pose::Identity());
    }
  }
  CollectLoops(model, robot);
  // Only building needs this table.
  dockings_at_ = {};
}

KinematicTree::Step KinematicTree::JointStep(const Joint& joint, bool places_a) {
  // The sense is that of A's motion as seen from B; where A is the parent, it is turned round.
  Step step;
  step.axis = joint.axis;
  step.origin = joint.p_MoJo_M;
  step.sign = places_a ? 1.0 : -1.0;
  if (joint.type == JointType::kFixed) return step;
  step.kind = joint.type == JointType::kPrismatic ? Kind::kSlide : Kind::kTurn;
  if (step.kind == Kind::kSlide) return step;
  // An axis along x, y or z changes two columns only; the sign takes up a negative one.
  for (int k = 0; k < 3; ++k) {
    if (std::abs(joint.axis[k]) != 1.0) continue;
    step.kind = static_cast<Kind>(static_cast<int>(Kind::kTurnX) + k);
    step.sign *= joint.axis[k];
  }
  return step;
}

void KinematicTree::Grow(const Model& model, const Robot& robot, const Omitted& omitted,
                         int start_module, int start_link, const Pose& X_RL) {
  // What an earlier tree has placed needs no tree of its own.
  if (placed_[LinkIndex(start_module, start_link)]) return;
  struct Place {
    int module;
    int link;
  };
  std::deque<Place> queue;
  // Places a link: a step is recorded, and the tree grows on from there.
  const auto place = [&](Step step, int module, int link, int parent) {
    step.link = LinkIndex(module, link);
    step.parent = parent;
    placed_[step.link] = true;
    steps_.push_back(step);
    queue.push_back({module, link});
  };
  // The root of the tree hangs from the robot frame.
  Step root;
  root.X_PL = X_RL;
  place(root, start_module, start_link, -1);
  while (!queue.empty()) {
    const Place at = queue.front();
    queue.pop_front();
    const int parent = LinkIndex(at.module, at.link);
    const ModuleType& type = model.TypeOf(robot, at.module);
    // Over the joints of the link's module to links that are not placed yet.
    for (size_t j = 0; j < type.joints.size(); ++j) {
      const Joint& joint = type.joints[j];
      // The link may be either end of the joint.
      if (joint.link_a != at.link && joint.link_b != at.link) continue;
      const bool places_a = joint.link_b == at.link;
      const int other = places_a ? joint.link_a : joint.link_b;
      if (placed_[LinkIndex(at.module, other)]) continue;
      // Joints that are left out count as if they were not there.
      const int flat = JointIndex(at.module, static_cast<int>(j));
      if (!omitted.joints.empty() && omitted.joints[flat]) continue;
      Step step = JointStep(joint, places_a);
      step.joint = flat;
      used_joint_[step.joint] = true;
      place(step, at.module, other, parent);
    }
    // Then over the dockings at the link to other modules.
    for (const int d : dockings_at_[parent]) {
      if (!omitted.dockings.empty() && omitted.dockings[d]) continue;
      const Docking& docking = robot.dockings[d];
      const int link_a = model.EndA(robot, docking).link;
      const int link_b = model.EndB(robot, docking).link;
      // The option's pose is b's in a's; seen from b it is inverted.
      const bool from_a = docking.module_a == at.module && link_a == at.link;
      const int module = from_a ? docking.module_b : docking.module_a;
      const int link = from_a ? link_b : link_a;
      if (placed_[LinkIndex(module, link)]) continue;
      const Pose& X_AB = model.OptionOf(docking).X_AB;
      Step step;
      step.X_PL = from_a ? X_AB : X_AB.inverse();
      step.docking = static_cast<int>(d);
      used_docking_[d] = true;
      place(step, module, link, parent);
    }
  }
}

void KinematicTree::CollectLoops(const Model& model, const Robot& robot) {
  // What the tree did not use closes a loop: dockings first, then joints of modules.
  for (size_t d = 0; d < robot.dockings.size(); ++d) {
    // A docking joins F, the link of connector a, to T, the link of connector b.
    if (used_docking_[d]) continue;
    const Docking& docking = robot.dockings[d];
    const Connector& a = model.EndA(robot, docking);
    Loop& loop = loops_.emplace_back();
    loop.docking = static_cast<int>(d);
    loop.link_from = LinkIndex(docking.module_a, a.link);
    loop.link_to = LinkIndex(docking.module_b, model.EndB(robot, docking).link);
    loop.X_FT = model.OptionOf(docking).X_AB;
    loop.p_F = a.p_MoCo_M;
  }
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    const ModuleType& type = model.module_types[robot.modules[m].type];
    for (size_t j = 0; j < type.joints.size(); ++j) {
      const int index = JointIndex(static_cast<int>(m), static_cast<int>(j));
      if (used_joint_[index]) continue;
      Loop& loop = loops_.emplace_back();
      loop.joint = index;
      loop.motion = type.joints[j];
      // JointMotion gives A's motion seen from B, so the loop runs from B to A.
      loop.link_from = LinkIndex(static_cast<int>(m), loop.motion.link_b);
      loop.link_to = LinkIndex(static_cast<int>(m), loop.motion.link_a);
      loop.p_F = loop.motion.p_MoJo_M;
    }
  }
}

void KinematicTree::Evaluate(const double* q, Pose* X_RL) const {
  for (const Step& step : steps_) {
    // The parent has been placed already, as each step comes after the one that it hangs from.
    Pose& X = X_RL[step.link];
    if (step.parent < 0) {
      X = step.X_PL;
      continue;
    }
    const Pose& X_RP = X_RL[step.parent];
    // Affine3d's product would also multiply the constant last row; the parts are written out.
    // R and p are the parts of X_RP, the parent's pose in the robot frame.
    const Eigen::Matrix3d R = X_RP.linear();
    const Vector3d p = X_RP.translation();
    if (step.kind == Kind::kFixed) {
      X.linear().noalias() = R * step.X_PL.linear();
      X.translation() = p + R * step.X_PL.translation();
      X.makeAffine();
      continue;
    }
    // Everything else is a joint; where the tree runs from A to B it moves the other way.
    const double angle = step.sign * q[step.joint];
    // A slide leaves the rotation as it is.
    if (step.kind == Kind::kSlide) {
      X.linear() = R;
      X.translation() = p + R * (angle * step.axis);
      X.makeAffine();
      continue;
    }
    // A turn about x, y or z changes two columns only; any other takes a whole rotation.
    Eigen::Matrix3d turned;
    const double s = std::sin(angle);
    const double c = std::cos(angle);
    switch (step.kind) {
      case Kind::kTurnX:
        TurnColumns<0>(R, s, c, turned);
        break;
      case Kind::kTurnY:
        TurnColumns<1>(R, s, c, turned);
        break;
      case Kind::kTurnZ:
        TurnColumns<2>(R, s, c, turned);
        break;
      default:
        turned = R * Eigen::AngleAxisd(angle, step.axis).toRotationMatrix();
    }
    // The point on the axis stays where it is.
    X.linear() = turned;
    X.translation() = p + R * step.origin - turned * step.origin;
    X.makeAffine();
  }
}

std::pair<double, double> KinematicTree::Gap(const Loop& loop, const double* q, const Pose* X_RL) {
  // What the docking or joint asks for, beside what the tree gives.
  const Pose X_FT = loop.docking >= 0 ? loop.X_FT : JointMotion(loop.motion, q[loop.joint]);
  // The poses in R give T in F as the tree has placed the two links.
  const Pose X_FT_tree = X_RL[loop.link_from].inverse() * X_RL[loop.link_to];
  // The gap is measured at the connector or joint, where a person would see it.
  const Vector3d p_T = X_FT.inverse() * loop.p_F;
  const double gap_m = (X_FT_tree * p_T - loop.p_F).norm();
  return {gap_m, AngleOf(X_FT.linear().transpose() * X_FT_tree.linear())};
}

}  // namespace morphbus::model
