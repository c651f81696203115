#include "compiler/emit/tree_cuts.h"

#include <algorithm>

#include "compiler/base/disjoint_sets.h"
#include "compiler/model/kinematic_graph.h"

namespace morphbus::emit {
namespace {

using model::KinematicTree;

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

}  // namespace

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
    const bool in_one_body = edge.rank == Rank::kRigid && bodies.Find(edge.a) == bodies.Find(edge.b);
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

}  // namespace morphbus::emit
