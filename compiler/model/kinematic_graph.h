#pragma once
// The kinematic graph (paper, Sec. IV and Fig. 6): vertices are bodies (largest sets of links held
// together by connections and fixed joints), edges are joints.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "compiler/model/forward_kinematics.h"

namespace morphbus::model {

/// A link of one of a robot's modules: the module by its place in the robot, the link by its place
/// in the module's type.
struct LinkRef {
  int module = 0;
  int link = 0;
};

/// A vertex of the graph: links that cannot move against each other.
struct Body {
  std::vector<LinkRef> links;
  /// The number of joints that touch this body.
  int degree = 0;
};

/// How two axes lie (paper, Sec. II). Parallel goes before all, orthogonal before the other two
/// (orthogonal axes may or may not meet); of the rest coplanar axes meet, skew ones do not.
enum class AxisRelation { kParallel, kOrthogonal, kSkew, kCoplanar };

/// The relation of the axes through p1 and p2 (m) with unit directions; tolerances 1e-6 rad and
/// 1e-6 of `extent` (m).
AxisRelation ClassifyAxes(const Eigen::Vector3d& p1, const Eigen::Vector3d& axis1,
                          const Eigen::Vector3d& p2, const Eigen::Vector3d& axis2, double extent);

/// An edge of the graph: a joint that can move, at the robot's start values.
struct GraphJoint {
  int module = 0;
  int joint = 0;
  /// The body of the joint's link_a, then that of its link_b.
  int body_a = 0;
  int body_b = 0;
  /// A point on the axis in the robot frame (m).
  Eigen::Vector3d p_RoJo_R;
  /// The unit direction of A's axis in the robot frame.
  Eigen::Vector3d axis_R;
  /// The number of other joints that touch either of its bodies.
  int num_adjacent = 0;
  /// Their indices in KinematicGraph::joints, ascending; see adjacency_listed.
  std::vector<int> adjacent;
  /// How the axes of those joints lie to this one, in the same order.
  std::vector<AxisRelation> adjacent_axes;
  /// True if it cannot move, by the loop-closure constraints.
  bool locked = false;
};

/// The graph of one robot. BuildKinematicGraph makes it; it refers to neither model nor robot.
struct KinematicGraph {
  std::vector<Body> bodies;
  /// body_of[module][link] is the index of the body that holds a link.
  std::vector<std::vector<int>> body_of;
  /// Every joint but the fixed ones, by module and then by joint.
  std::vector<GraphJoint> joints;
  /// False where the lists would be too long (a body with thousands of joints): over
  /// kMaxAdjacencies in all. Counts are there all the same.
  bool adjacency_listed = true;
  /// Null-space dimension, floating base not counted; absent unless locked_computed.
  std::optional<int> mobility;
  /// False where a biconnected part has over 500 joints (kMaxLoopJoints).
  bool locked_computed = true;
};

/// The most entries that all lists of adjacent joints may have together: a bound on memory.
inline constexpr int64_t kMaxAdjacencies = 2'000'000;

/// The kinematic graph of `robot` at its start values. `robot` is one of `model`'s.
KinematicGraph BuildKinematicGraph(const Model& model, const Robot& robot);

/// The body of each link, as body_of[module][link]; bodies are numbered by their first appearance
/// in that order. Links held together by dockings or fixed joints are one body. This part of the
/// graph needs neither poses nor the analysis of loops.
std::vector<std::vector<int>> BodiesOf(const Model& model, const Robot& robot);

}  // namespace morphbus::model
