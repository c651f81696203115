#include "compiler/model/kinematic_graph.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "compiler/base/disjoint_sets.h"
#include "compiler/model/loop_constraints.h"

namespace morphbus::model {
namespace {

using Eigen::Vector3d;

/// Adds all joints that move, with their axes at the start values.
void AddJoints(const Model& model, const Robot& robot, KinematicGraph& graph) {
  const KinematicState state = ForwardKinematics(model, robot, StartValues(robot));
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    const ModuleType& type = model.module_types[robot.modules[m].type];
    for (size_t j = 0; j < type.joints.size(); ++j) {
      const Joint& joint = type.joints[j];
      if (joint.type == JointType::kFixed) continue;
      // The axis is fixed in both links; B's frame carries it as the module was drawn.
      const Pose& X_RB = state.X_RL[m][joint.link_b];
      GraphJoint& entry = graph.joints.emplace_back();
      entry.module = static_cast<int>(m);
      entry.joint = static_cast<int>(j);
      entry.body_a = graph.body_of[m][joint.link_a];
      entry.body_b = graph.body_of[m][joint.link_b];
      entry.p_RoJo_R = X_RB * joint.p_MoJo_M;
      entry.axis_R = X_RB.linear() * joint.axis;
      // A joint whose ends are on one body touches it once.
      ++graph.bodies[entry.body_a].degree;
      if (entry.body_b != entry.body_a) ++graph.bodies[entry.body_b].degree;
    }
  }
}

/// Fills in which joints touch the same bodies and how their axes lie; `extent` (m) sets the
/// tolerance.
void FindAdjacency(KinematicGraph& graph, double extent) {
  // The joints at each body, each once.
  std::vector<std::vector<int>> at_body(graph.bodies.size());
  for (int i = 0; i < std::ssize(graph.joints); ++i) {
    const GraphJoint& joint = graph.joints[i];
    at_body[joint.body_a].push_back(i);
    if (joint.body_b != joint.body_a) at_body[joint.body_b].push_back(i);
  }
  // Joints of the same two bodies touch both; the others one of them.
  std::map<std::pair<int, int>, int> between;
  const auto ends = [](const GraphJoint& joint) {
    return std::pair<int, int>(std::minmax(joint.body_a, joint.body_b));
  };
  for (const GraphJoint& joint : graph.joints) ++between[ends(joint)];
  int64_t entries = 0;
  for (GraphJoint& joint : graph.joints) {
    // Joints at both bodies would be counted twice, and the joint itself does not count.
    joint.num_adjacent = static_cast<int>(at_body[joint.body_a].size()) - 1;
    if (joint.body_b != joint.body_a) {
      joint.num_adjacent += static_cast<int>(at_body[joint.body_b].size()) - between[ends(joint)];
    }
    entries += joint.num_adjacent;
  }
  // The counts are cheap, the lists may be quadratic: a body with thousands of joints gets none.
  graph.adjacency_listed = entries <= kMaxAdjacencies;
  if (!graph.adjacency_listed) return;
  // The joints at both of its bodies are its neighbours, each listed once.
  for (size_t i = 0; i < graph.joints.size(); ++i) {
    GraphJoint& joint = graph.joints[i];
    for (const int body : {joint.body_a, joint.body_b}) {
      for (const int other : at_body[body]) {
        if (other != static_cast<int>(i)) joint.adjacent.push_back(other);
      }
    }
    std::sort(joint.adjacent.begin(), joint.adjacent.end());
    joint.adjacent.erase(std::unique(joint.adjacent.begin(), joint.adjacent.end()),
                         joint.adjacent.end());
    for (const int other : joint.adjacent) {
      const GraphJoint& o = graph.joints[other];
      joint.adjacent_axes.push_back(
          ClassifyAxes(joint.p_RoJo_R, joint.axis_R, o.p_RoJo_R, o.axis_R, extent));
    }
  }
}

}  // namespace

AxisRelation ClassifyAxes(const Vector3d& p1, const Vector3d& axis1, const Vector3d& p2,
                          const Vector3d& axis2, double extent) {
  constexpr double kTolerance = 1e-6;  // rad, and of the extent
  // The common normal is as long as the sine of the angle, and the distance of the axes is measured
  // along it.
  const Vector3d normal = axis1.cross(axis2);
  if (normal.norm() <= kTolerance) return AxisRelation::kParallel;
  if (std::abs(axis1.dot(axis2)) <= kTolerance) return AxisRelation::kOrthogonal;
  const double distance = std::abs(normal.normalized().dot(p2 - p1));
  return distance <= kTolerance * extent ? AxisRelation::kCoplanar : AxisRelation::kSkew;
}

std::vector<std::vector<int>> BodiesOf(const Model& model, const Robot& robot) {
  // Links of all modules are numbered in one row; first[m] is the number of module m's first link.
  std::vector<int> first;
  int count = 0;
  for (const ModuleInstance& module : robot.modules) {
    first.push_back(count);
    count += static_cast<int>(model.module_types[module.type].links.size());
  }
  // Every link starts as a body of its own.
  DisjointSets bodies(count);
  // Dockings and fixed joints hold links together.
  for (const Docking& d : robot.dockings) {
    bodies.Unite(first[d.module_a] + model.EndA(robot, d).link,
                 first[d.module_b] + model.EndB(robot, d).link);
  }
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    for (const Joint& joint : model.module_types[robot.modules[m].type].joints) {
      if (joint.type != JointType::kFixed) continue;
      bodies.Unite(first[m] + joint.link_a, first[m] + joint.link_b);
    }
  }
  // Bodies are numbered as they appear.
  std::vector<int> number(count, -1);
  int next = 0;
  std::vector<std::vector<int>> body_of;
  for (int m = 0; m < std::ssize(robot.modules); ++m) {
    body_of.emplace_back();
    for (int l = 0; l < std::ssize(model.TypeOf(robot, m).links); ++l) {
      int& body = number[bodies.Find(first[m] + l)];
      if (body < 0) body = next++;
      body_of.back().push_back(body);
    }
  }
  return body_of;
}

KinematicGraph BuildKinematicGraph(const Model& model, const Robot& robot) {
  // The vertices are the bodies, with their links in declared order.
  KinematicGraph graph;
  graph.body_of = BodiesOf(model, robot);
  for (size_t m = 0; m < graph.body_of.size(); ++m) {
    for (size_t l = 0; l < graph.body_of[m].size(); ++l) {
      const size_t body = static_cast<size_t>(graph.body_of[m][l]);
      if (body >= graph.bodies.size()) graph.bodies.resize(body + 1);
      graph.bodies[body].links.push_back({static_cast<int>(m), static_cast<int>(l)});
    }
  }
  AddJoints(model, robot, graph);
  // Tolerances are relative to the largest module.
  double extent = 0.0;
  for (const ModuleInstance& module : robot.modules) {
    extent = std::max(extent, ExtentOf(model.module_types[module.type]));
  }
  FindAdjacency(graph, extent);

  // Mobility and locking follow from the loops that the axes make at the start values.
  std::vector<ScrewJoint> screws;
  for (const GraphJoint& joint : graph.joints) {
    const JointType type = model.TypeOf(robot, joint.module).joints[joint.joint].type;
    screws.push_back(
        {joint.body_a, joint.body_b, type == JointType::kPrismatic, joint.axis_R, joint.p_RoJo_R});
  }
  const LoopMobility loops = ComputeLoopMobility(static_cast<int>(graph.bodies.size()), screws);
  if (loops.computed) graph.mobility = loops.mobility;
  graph.locked_computed = loops.computed;
  for (size_t i = 0; i < graph.joints.size(); ++i) graph.joints[i].locked = loops.locked[i];
  return graph;
}

}  // namespace morphbus::model
