#include "compiler/emit/tree_cuts.h"

#include <algorithm>
#include <numeric>

#include "compiler/model/kinematic_graph.h"

namespace morphbus::emit {
namespace {

using model::KinematicTree;

/// Sets of links that are held together.
class Sets {
 public:
  explicit Sets(int count) : parent_(static_cast<size_t>(count)) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  /// False if they were together already.
  bool Join(int a, int b) {
    a = Find(a);
    b = Find(b);
    parent_[static_cast<size_t>(a)] = b;
    return a != b;
  }
  bool Together(int a, int b) { return Find(a) == Find(b); }

 private:
  int Find(int a) {
    while (parent_[static_cast<size_t>(a)] != a) {
      int& parent = parent_[static_cast<size_t>(a)];
      parent = parent_[static_cast<size_t>(parent)];
      a = parent;
    }
    return a;
  }
  std::vector<int> parent_;
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
  std::vector<int> steps(static_cast<size_t>(tree.num_links()), 0);
  for (const KinematicTree::Step& step : tree.steps()) {
    if (step.parent < 0) continue;
    steps[static_cast<size_t>(step.link)] = steps[static_cast<size_t>(step.parent)] + 1;
  }
  return steps;
}

std::vector<bool> LockedJoints(const model::Model& model, const model::Robot& robot,
                               const KinematicTree& tree) {
  std::vector<bool> locked(static_cast<size_t>(tree.num_joints()), false);
  if (tree.loops().empty()) return locked;
  for (const model::GraphJoint& joint : model::BuildKinematicGraph(model, robot).joints) {
    locked[static_cast<size_t>(tree.JointIndex(joint.module, joint.joint))] = joint.locked;
  }
  return locked;
}

std::vector<Edge> EdgesOf(const model::Model& model, const model::Robot& robot,
                          const KinematicTree& tree, const std::vector<bool>& locked) {
  const std::vector<int> steps = StepsFromRoot(tree);
  std::vector<Edge> edges;
  const auto add = [&](Edge edge, int module_a, int link_a, int module_b, int link_b) {
    edge.a = tree.LinkIndex(module_a, link_a);
    edge.b = tree.LinkIndex(module_b, link_b);
    edge.distance = steps[static_cast<size_t>(edge.a)] + steps[static_cast<size_t>(edge.b)];
    edges.push_back(edge);
  };
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    const int module = static_cast<int>(m);
    const model::ModuleType& type = model.TypeOf(robot, module);
    for (size_t j = 0; j < type.joints.size(); ++j) {
      Edge edge;
      edge.joint = tree.JointIndex(module, static_cast<int>(j));
      const bool fixed = type.joints[j].type == model::JointType::kFixed;
      edge.rank = fixed                                     ? Rank::kRigid
                  : locked[static_cast<size_t>(edge.joint)] ? Rank::kLocked
                                                            : Rank::kMoves;
      add(edge, module, type.joints[j].link_a, module, type.joints[j].link_b);
    }
  }
  for (size_t d = 0; d < robot.dockings.size(); ++d) {
    const model::Docking& docking = robot.dockings[d];
    const auto link = [&](int module, int connector) {
      return model.TypeOf(robot, module).connectors[static_cast<size_t>(connector)].link;
    };
    Edge edge;
    edge.docking = static_cast<int>(d);
    add(edge, docking.module_a, link(docking.module_a, docking.connector_a), docking.module_b,
        link(docking.module_b, docking.connector_b));
  }
  return edges;
}

}  // namespace

TreeCuts CutLoops(const model::Model& model, const model::Robot& robot) {
  const KinematicTree tree(model, robot);
  TreeCuts cuts;
  cuts.locked = LockedJoints(model, robot, tree);
  cuts.redundant.assign(robot.dockings.size(), false);
  cuts.omitted.dockings.assign(robot.dockings.size(), false);
  cuts.omitted.joints.assign(static_cast<size_t>(tree.num_joints()), false);
  std::vector<Edge> edges = EdgesOf(model, robot, tree, cuts.locked);
  // Kruskal's spanning tree: what is kept first is cut last.
  std::stable_sort(edges.begin(), edges.end(), [](const Edge& x, const Edge& y) {
    return x.rank != y.rank ? x.rank < y.rank : x.distance < y.distance;
  });
  Sets held(tree.num_links());
  Sets bodies(tree.num_links());
  for (const Edge& edge : edges) {
    const bool in_one_body = edge.rank == Rank::kRigid && bodies.Together(edge.a, edge.b);
    if (held.Join(edge.a, edge.b)) {
      if (edge.rank == Rank::kRigid) bodies.Join(edge.a, edge.b);
    } else if (edge.joint >= 0) {
      cuts.omitted.joints[static_cast<size_t>(edge.joint)] = true;
    } else {
      cuts.omitted.dockings[static_cast<size_t>(edge.docking)] = true;
      cuts.redundant[static_cast<size_t>(edge.docking)] = in_one_body;
    }
  }
  return cuts;
}

}  // namespace morphbus::emit
