#include "compiler/emit/robot_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "compiler/base/disjoint_sets.h"
#include "compiler/emit/link_solids.h"
#include "compiler/model/forward_kinematics.h"
#include "compiler/model/kinematic_graph.h"
#include "compiler/model/kinematic_tree.h"

namespace morphbus::emit {
namespace {

using model::KinematicTree;

/// "m1.joint_1", or "joint_1" for a module type alone.
std::string FullName(const std::string& module, const std::string& name) {
  return module.empty() ? name : module + "." + name;
}

// "m1.c2-m2.c5": both ends of the docking.
std::string DockingName(const model::Model& model, const model::Robot& robot, int index) {
  const model::Docking& d = robot.dockings[index];
  return robot.modules[d.module_a].name + "." + model.EndA(robot, d).name + "-" +
         robot.modules[d.module_b].name + "." + model.EndB(robot, d).name;
}

// All joints of the robot, modules in order, each module's as its type declares them.
std::vector<TreeJoint> JointsOf(const model::Model& model, const model::Robot& robot) {
  std::vector<TreeJoint> joints;
  for (const model::ModuleInstance& module : robot.modules) {
    const model::ModuleType& type = model.module_types[module.type];
    for (size_t j = 0; j < type.joints.size(); ++j) {
      const model::Joint& from = type.joints[j];
      joints.push_back({.name = FullName(module.name, from.name),
                        .type = from.type,
                        .origin = from.p_MoJo_M,
                        .axis = from.axis,
                        .lower = from.lower,
                        .upper = from.upper,
                        .effort = from.effort,
                        .speed = from.speed,
                        .start = module.start[j]});
    }
  }
  return joints;
}

/// The links in the order of `kinematics`, and what it leaves open.
RobotTree TreeAlong(const model::Model& model, const model::Robot& robot,
                    const KinematicTree& kinematics) {
  // Joints as declared; those that the tree runs against get their axes turned below.
  RobotTree tree;
  tree.name = robot.name;
  tree.joints = JointsOf(model, robot);

  struct Place {
    int module;
    int link;
  };
  std::vector<Place> place_of;  // By flat index of link.
  for (int m = 0; m < std::ssize(robot.modules); ++m) {
    for (int l = 0; l < std::ssize(model.TypeOf(robot, m).links); ++l) place_of.push_back({m, l});
  }
  std::vector<int> index_of(place_of.size(), -1);  // Flat index to index in the tree.
  // Links in the order in which the kinematic tree places them, each after its parent.
  for (const KinematicTree::Step& step : kinematics.steps()) {
    const Place place = place_of[step.link];
    const model::ModuleInstance& module = robot.modules[place.module];
    const model::ModuleType& type = model.module_types[module.type];
    TreeLink link;
    // Indices are those of the model; the name is what other programs show.
    link.name = FullName(module.name, type.links[place.link].name);
    link.module = place.module;
    link.type = module.type;
    link.link = place.link;
    // What holds the link: a docking, a joint, or, for a root, nothing.
    link.parent = step.parent < 0 ? -1 : index_of[step.parent];
    link.joint = step.joint;
    link.X_PL = step.X_PL;
    if (step.docking >= 0) link.held_by = DockingName(model, robot, step.docking);
    if (step.joint >= 0) {
      TreeJoint& joint = tree.joints[step.joint];
      link.held_by = joint.name;
      joint.child = static_cast<int>(tree.links.size());
      // The tree may run from A to B: then the same value turns the child the other way.
      const model::Joint& declared =
          type.joints[step.joint - kinematics.JointIndex(place.module, 0)];
      if (declared.link_b == place.link) joint.axis = -joint.axis;
    }
    index_of[step.link] = static_cast<int>(tree.links.size());
    tree.links.push_back(std::move(link));
  }
  // What the tree leaves open, with the pose that closes it at joint values 0.
  for (const KinematicTree::Loop& from : kinematics.loops()) {
    TreeLoop& loop = tree.loops.emplace_back();
    loop.from = index_of[from.link_from];
    loop.to = index_of[from.link_to];
    loop.joint = from.joint;
    // A joint moves frames that coincide at joint value 0, so its pose stays the identity.
    if (from.docking >= 0) loop.X_FT = from.X_FT;
    loop.name =
        from.docking >= 0 ? DockingName(model, robot, from.docking) : tree.joints[from.joint].name;
  }
  return tree;
}

// ---- Cuts: which edges of a robot go where a format holds trees only ----

struct TreeCuts {
  model::KinematicTree::Omitted omitted;  ///< What goes, so that the links form a tree.
  /// Of the dockings that go, those whose ends other dockings of the same body still hold together:
  /// nothing is lost with them. By index into Robot::dockings.
  std::vector<bool> redundant;
  /// Joints that cannot move, by the robot's loops, by flat index. None where that is not computed
  /// (see model::KinematicGraph::locked_computed).
  std::vector<bool> locked;
};

/// In the order in which edges are kept.
enum class Rank { kMoves, kRigid, kLocked };

struct Edge {
  Rank rank = Rank::kRigid;
  int distance = 0;  ///< Steps from the root link to both ends together.
  int a = 0;         ///< Flat indices of links.
  int b = 0;
  int docking = -1;
  int joint = -1;
};

/// Joints and dockings between the root link and each link, by flat index.
std::vector<int> StepsFromRoot(const KinematicTree& tree) {
  // A link stands one step beyond its parent, which comes before it.
  std::vector<int> steps(tree.num_links(), 0);
  for (const KinematicTree::Step& step : tree.steps()) {
    if (step.parent < 0) continue;
    steps[step.link] = steps[step.parent] + 1;
  }
  return steps;
}

std::vector<bool> LockedJoints(const model::Model& model, const model::Robot& robot,
                               const KinematicTree& tree) {
  // Without loops nothing can be locked, and the graph need not be built.
  std::vector<bool> locked(tree.num_joints(), false);
  if (tree.loops().empty()) return locked;
  for (const model::GraphJoint& joint : model::BuildKinematicGraph(model, robot).joints) {
    locked[tree.JointIndex(joint.module, joint.joint)] = joint.locked;
  }
  return locked;
}

std::vector<Edge> EdgesOf(const model::Model& model, const model::Robot& robot,
                          const KinematicTree& tree, const std::vector<bool>& locked) {
  // Every joint and every docking is an edge between two links.
  const std::vector<int> steps = StepsFromRoot(tree);
  std::vector<Edge> edges;
  const auto add = [&](Edge edge, int module_a, int link_a, int module_b, int link_b) {
    edge.a = tree.LinkIndex(module_a, link_a);
    edge.b = tree.LinkIndex(module_b, link_b);
    edge.distance = steps[edge.a] + steps[edge.b];
    edges.push_back(edge);
  };
  // Joints: fixed ones hold like dockings, locked ones move in no posture of the robot.
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    const int module = static_cast<int>(m);
    const model::ModuleType& type = model.TypeOf(robot, module);
    for (size_t j = 0; j < type.joints.size(); ++j) {
      Edge edge;
      edge.joint = tree.JointIndex(module, static_cast<int>(j));
      const bool fixed = type.joints[j].type == model::JointType::kFixed;
      edge.rank = fixed ? Rank::kRigid : locked[edge.joint] ? Rank::kLocked : Rank::kMoves;
      add(edge, module, type.joints[j].link_a, module, type.joints[j].link_b);
    }
  }
  // Dockings: they join the links that carry their connectors.
  for (size_t d = 0; d < robot.dockings.size(); ++d) {
    const model::Docking& docking = robot.dockings[d];
    Edge edge;
    edge.docking = static_cast<int>(d);
    add(edge, docking.module_a, model.EndA(robot, docking).link, docking.module_b,
        model.EndB(robot, docking).link);
  }
  return edges;
}

/// Cuts each loop where least is lost: redundant dockings inside a body first, then locked joints,
/// then the docking farthest from the root link (by joints and dockings between; of equals the one
/// declared last); a joint that can move only where a module's own links form a loop.
TreeCuts CutLoops(const model::Model& model, const model::Robot& robot) {
  // Nothing is cut to begin with.
  const KinematicTree tree(model, robot);
  TreeCuts cuts;
  cuts.locked = LockedJoints(model, robot, tree);
  cuts.redundant.assign(robot.dockings.size(), false);
  cuts.omitted.dockings.assign(robot.dockings.size(), false);
  cuts.omitted.joints.assign(tree.num_joints(), false);
  std::vector<Edge> edges = EdgesOf(model, robot, tree, cuts.locked);
  // Kruskal's spanning tree: what is kept first is cut last.
  std::stable_sort(edges.begin(), edges.end(), [](const Edge& x, const Edge& y) {
    return x.rank != y.rank ? x.rank < y.rank : x.distance < y.distance;
  });
  // Edges that join what is held together already close a loop and are cut. One within a rigid body
  // is redundant: the body holds without it.
  DisjointSets held(tree.num_links());
  DisjointSets bodies(tree.num_links());
  for (const Edge& edge : edges) {
    const bool in_one_body =
        edge.rank == Rank::kRigid && bodies.Find(edge.a) == bodies.Find(edge.b);
    if (held.Unite(edge.a, edge.b)) {
      if (edge.rank == Rank::kRigid) bodies.Unite(edge.a, edge.b);
    } else if (edge.joint >= 0) {
      cuts.omitted.joints[edge.joint] = true;
    } else {
      cuts.omitted.dockings[edge.docking] = true;
      cuts.redundant[edge.docking] = in_one_body;
    }
  }
  return cuts;
}

}  // namespace

RobotTree TreeOf(const model::Model& model, const model::Robot& robot) {
  return TreeAlong(model, robot, KinematicTree(model, robot));
}

RobotTree OpenTreeOf(const model::Model& model, const model::Robot& robot) {
  // The cuts are chosen first, then the tree goes along what is left.
  const TreeCuts cuts = CutLoops(model, robot);
  const KinematicTree kinematics(model, robot, cuts.omitted);
  RobotTree tree = TreeAlong(model, robot, kinematics);
  for (size_t j = 0; j < tree.joints.size(); ++j) tree.joints[j].locked = cuts.locked[j];
  for (size_t i = 0; i < tree.loops.size(); ++i) {
    const KinematicTree::Loop& loop = kinematics.loops()[i];
    // What each cut costs, for the warnings of the formats that hold trees only.
    if (loop.docking >= 0 && cuts.redundant[loop.docking]) {
      tree.loops[i].loss = TreeLoop::Loss::kNothing;
    } else if (loop.joint >= 0 && cuts.locked[loop.joint]) {
      tree.loops[i].loss = TreeLoop::Loss::kLockedJoint;
    }
  }
  return tree;
}

model::Robot ModuleAsRobot(const model::Model& model, int type) {
  const model::ModuleType& module = model.module_types[type];
  model::Robot robot;
  robot.name = module.name;
  // One module without a name, so that links and joints have only their own.
  model::ModuleInstance instance;
  instance.type = type;
  for (const model::Joint& joint : module.joints) {
    // 0 is the natural start, but it need not lie within the limits.
    instance.start.push_back(std::clamp(0.0, joint.lower, joint.upper));
  }
  robot.modules.push_back(std::move(instance));
  return robot;
}

double LowestPoint(const model::Model& model, const RobotTree& tree) {
  // Corners of hulls only: a robot without hulls touches nothing.
  double lowest = std::numeric_limits<double>::infinity();
  const std::vector<model::Pose> X_RL = StartPoses(tree);
  LinkSolids solids(model);
  for (size_t i = 0; i < tree.links.size(); ++i) {
    for (const auto& part : solids.Parts(tree.links[i].type, tree.links[i].link)) {
      for (const Eigen::Vector3d& p : part) lowest = std::min(lowest, (X_RL[i] * p).y());
    }
  }
  return std::isfinite(lowest) ? lowest : 0.0;
}

model::Pose RobotFrameInZUp() {
  model::Pose X_WR = model::Pose::Identity();
  // x stays, y goes up to z, and z goes to -y.
  X_WR.linear() << 1, 0, 0,  //
      0, 0, -1,              //
      0, 1, 0;
  return X_WR;
}

// Trans(o) * Rot(axis, q) * Trans(-o), or Trans(q * axis) for a joint that slides (model::Joint).
model::Pose MotionOf(const TreeJoint& joint, double q) {
  model::Joint motion;
  motion.type = joint.type;
  motion.p_MoJo_M = joint.origin;
  motion.axis = joint.axis;
  return model::JointMotion(motion, q);
}

model::Pose StartInParent(const RobotTree& tree, const model::Pose& X_PL, int joint) {
  return joint < 0 ? X_PL : X_PL * MotionOf(tree.joints[joint], tree.joints[joint].start);
}

// A link stands on its parent's pose, moved by its joint's start value.
std::vector<model::Pose> StartPoses(const RobotTree& tree) {
  std::vector<model::Pose> X_RL;
  X_RL.reserve(tree.links.size());
  for (const TreeLink& link : tree.links) {
    const model::Pose X = StartInParent(tree, link.X_PL, link.joint);
    // Parents stand before their children, so their poses are known.
    X_RL.push_back(link.parent < 0 ? X : X_RL[link.parent] * X);
  }
  return X_RL;
}

// The distance of the origin from the axis; a joint that slides has no place.
bool AxisIsOffOrigin(const TreeJoint& joint) {
  if (joint.type == model::JointType::kPrismatic || joint.type == model::JointType::kFixed) {
    return false;
  }
  // The cross product with the unit axis has the length of that distance (m).
  return joint.origin.cross(joint.axis).norm() > 1e-12;
}

}  // namespace morphbus::emit
