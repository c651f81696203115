#include "compiler/emit/robot_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "compiler/emit/link_solids.h"
#include "compiler/emit/tree_cuts.h"
#include "compiler/model/forward_kinematics.h"
#include "compiler/model/kinematic_tree.h"

namespace morphbus::emit {
namespace {

using model::KinematicTree;

/// "m1.joint_1", or "joint_1" for a module type alone.
std::string FullName(const std::string& module, const std::string& name) {
  return module.empty() ? name : module + "." + name;
}

std::string DockingName(const model::Model& model, const model::Robot& robot, int index) {
  const model::Docking& d = robot.dockings[static_cast<size_t>(index)];
  const model::ModuleType& type_a = model.TypeOf(robot, d.module_a);
  const model::ModuleType& type_b = model.TypeOf(robot, d.module_b);
  return robot.modules[static_cast<size_t>(d.module_a)].name + "." +
         type_a.connectors[static_cast<size_t>(d.connector_a)].name + "-" +
         robot.modules[static_cast<size_t>(d.module_b)].name + "." +
         type_b.connectors[static_cast<size_t>(d.connector_b)].name;
}

std::vector<TreeJoint> JointsOf(const model::Model& model, const model::Robot& robot) {
  std::vector<TreeJoint> joints;
  for (const model::ModuleInstance& module : robot.modules) {
    const model::ModuleType& type = model.module_types[static_cast<size_t>(module.type)];
    for (size_t j = 0; j < type.joints.size(); ++j) {
      const model::Joint& from = type.joints[j];
      TreeJoint joint;
      joint.name = FullName(module.name, from.name);
      joint.type = from.type;
      joint.origin = from.p_MoJo_M;
      joint.axis = from.axis;
      joint.lower = from.lower;
      joint.upper = from.upper;
      joint.effort = from.effort;
      joint.speed = from.speed;
      joint.start = module.start[j];
      joints.push_back(std::move(joint));
    }
  }
  return joints;
}

/// The links in the order of `kinematics`, and what it leaves open.
RobotTree TreeAlong(const model::Model& model, const model::Robot& robot,
                    const KinematicTree& kinematics) {
  RobotTree tree;
  tree.name = robot.name;
  tree.joints = JointsOf(model, robot);

  struct Place {
    int module;
    int link;
  };
  std::vector<Place> place_of;  // By flat index of link.
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    const size_t links = model.TypeOf(robot, static_cast<int>(m)).links.size();
    for (size_t l = 0; l < links; ++l) {
      place_of.push_back({static_cast<int>(m), static_cast<int>(l)});
    }
  }
  std::vector<int> index_of(place_of.size(), -1);  // Flat index to index in the tree.
  for (const KinematicTree::Step& step : kinematics.steps()) {
    const Place place = place_of[static_cast<size_t>(step.link)];
    const model::ModuleInstance& module = robot.modules[static_cast<size_t>(place.module)];
    const model::ModuleType& type = model.module_types[static_cast<size_t>(module.type)];
    TreeLink link;
    link.name = FullName(module.name, type.links[static_cast<size_t>(place.link)].name);
    link.module = place.module;
    link.type = module.type;
    link.link = place.link;
    link.parent = step.parent < 0 ? -1 : index_of[static_cast<size_t>(step.parent)];
    link.joint = step.joint;
    link.X_PL = step.X_PL;
    if (step.docking >= 0) link.held_by = DockingName(model, robot, step.docking);
    if (step.joint >= 0) {
      TreeJoint& joint = tree.joints[static_cast<size_t>(step.joint)];
      link.held_by = joint.name;
      joint.child = static_cast<int>(tree.links.size());
      // The tree may run from A to B: then the same value turns the child the other way.
      const model::Joint& declared =
          type.joints[static_cast<size_t>(step.joint - kinematics.JointIndex(place.module, 0))];
      if (declared.link_b == place.link) joint.axis = -joint.axis;
    }
    index_of[static_cast<size_t>(step.link)] = static_cast<int>(tree.links.size());
    tree.links.push_back(std::move(link));
  }
  for (const KinematicTree::Loop& from : kinematics.loops()) {
    TreeLoop loop;
    loop.from = index_of[static_cast<size_t>(from.link_from)];
    loop.to = index_of[static_cast<size_t>(from.link_to)];
    loop.joint = from.joint;
    if (from.docking >= 0) loop.X_FT = from.X_FT;
    loop.name = from.docking >= 0 ? DockingName(model, robot, from.docking)
                                  : tree.joints[static_cast<size_t>(from.joint)].name;
    tree.loops.push_back(std::move(loop));
  }
  return tree;
}

}  // namespace

RobotTree TreeOf(const model::Model& model, const model::Robot& robot) {
  return TreeAlong(model, robot, KinematicTree(model, robot));
}

RobotTree OpenTreeOf(const model::Model& model, const model::Robot& robot) {
  const TreeCuts cuts = CutLoops(model, robot);
  const KinematicTree kinematics(model, robot, cuts.omitted);
  RobotTree tree = TreeAlong(model, robot, kinematics);
  for (size_t j = 0; j < tree.joints.size(); ++j) tree.joints[j].locked = cuts.locked[j];
  for (size_t i = 0; i < tree.loops.size(); ++i) {
    const KinematicTree::Loop& loop = kinematics.loops()[i];
    if (loop.docking >= 0 && cuts.redundant[static_cast<size_t>(loop.docking)]) {
      tree.loops[i].loss = TreeLoop::Loss::kNothing;
    } else if (loop.joint >= 0 && cuts.locked[static_cast<size_t>(loop.joint)]) {
      tree.loops[i].loss = TreeLoop::Loss::kLockedJoint;
    }
  }
  return tree;
}

model::Robot ModuleAsRobot(const model::Model& model, int type) {
  const model::ModuleType& module = model.module_types[static_cast<size_t>(type)];
  model::Robot robot;
  robot.name = module.name;
  model::ModuleInstance instance;
  instance.type = type;
  for (const model::Joint& joint : module.joints) {
    instance.start.push_back(std::clamp(0.0, joint.lower, joint.upper));
  }
  robot.modules.push_back(std::move(instance));
  return robot;
}

const char* JointTypeName(model::JointType type) {
  switch (type) {
    case model::JointType::kRevolute:
      return "revolute";
    case model::JointType::kContinuous:
      return "continuous";
    case model::JointType::kPrismatic:
      return "prismatic";
    case model::JointType::kFixed:
      break;
  }
  return "fixed";
}

double LowestPoint(const model::Model& model, const RobotTree& tree) {
  double lowest = std::numeric_limits<double>::infinity();
  const std::vector<model::Pose> X_RL = StartPoses(tree);
  LinkSolids solids(model);
  for (size_t i = 0; i < tree.links.size(); ++i) {
    for (const Eigen::Vector3d& p : solids.Hull(tree.links[i].type, tree.links[i].link)) {
      lowest = std::min(lowest, (X_RL[i] * p).y());
    }
  }
  return std::isfinite(lowest) ? lowest : 0.0;
}

model::Pose RobotFrameInZUp() {
  model::Pose X_WR = model::Pose::Identity();
  X_WR.linear() << 1, 0, 0,  //
      0, 0, -1,              //
      0, 1, 0;
  return X_WR;
}

model::Pose MotionOf(const TreeJoint& joint, double q) {
  model::Joint motion;
  motion.type = joint.type;
  motion.p_MoJo_M = joint.origin;
  motion.axis = joint.axis;
  return model::JointMotion(motion, q);
}

std::vector<model::Pose> StartPoses(const RobotTree& tree) {
  std::vector<model::Pose> X_RL;
  X_RL.reserve(tree.links.size());
  for (const TreeLink& link : tree.links) {
    model::Pose X = link.X_PL;
    if (link.joint >= 0) {
      const TreeJoint& joint = tree.joints[static_cast<size_t>(link.joint)];
      X = X * MotionOf(joint, joint.start);
    }
    X_RL.push_back(link.parent < 0 ? X : X_RL[static_cast<size_t>(link.parent)] * X);
  }
  return X_RL;
}

bool AxisIsOffOrigin(const TreeJoint& joint) {
  if (joint.type == model::JointType::kPrismatic || joint.type == model::JointType::kFixed) {
    return false;
  }
  return joint.origin.cross(joint.axis).norm() > 1e-12;
}

}  // namespace morphbus::emit
