#pragma once
// The kinematic graph (paper, Sec. IV and Fig. 6): vertices are bodies (largest sets of links held
// together by connections and fixed joints), edges are joints.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "compiler/model/forward_kinematics.h"

namespace morphbus::model {

struct LinkRef {
  int module = 0;
  int link = 0;
};

struct Body {
  std::vector<LinkRef> links;
  int degree = 0;  ///< Number of joints that touch this body.
};

/// How two axes lie (paper, Sec. II). Parallel goes before all, orthogonal before the other two
/// (orthogonal axes may or may not meet); of the rest coplanar axes meet, skew ones do not.
enum class AxisRelation { kParallel, kOrthogonal, kSkew, kCoplanar };

/// The relation of the axes through p1 and p2 (m) with unit directions; tolerances 1e-6 rad and
/// 1e-6 of `extent` (m).
AxisRelation ClassifyAxes(const Eigen::Vector3d& p1, const Eigen::Vector3d& axis1,
                          const Eigen::Vector3d& p2, const Eigen::Vector3d& axis2, double extent);

struct GraphJoint {
  int module = 0;
  int joint = 0;
  int body_a = 0;  ///< Body of the joint's link_a.
  int body_b = 0;
  Eigen::Vector3d p_RoJo_R;   ///< A point on the axis, robot frame (m), at the start values.
  Eigen::Vector3d axis_R;     ///< Unit direction of A's axis in the robot frame, start values.
  int num_adjacent = 0;       ///< Other joints that touch either of its bodies.
  std::vector<int> adjacent;  ///< Their indices in KinematicGraph::joints; see adjacency_listed.
  std::vector<AxisRelation> adjacent_axes;  ///< How their axes lie to this one, same order.
  bool locked = false;  ///< Cannot move, by the loop-closure constraints at the start values.
};

struct KinematicGraph {
  std::vector<Body> bodies;
  std::vector<std::vector<int>> body_of;  ///< body_of[module][link].
  std::vector<GraphJoint> joints;         ///< Every joint but fixed ones, module then joint order.
  /// False where the lists would be too long (a body with thousands of joints): over
  /// kMaxAdjacencies in all. Counts are there all the same.
  bool adjacency_listed = true;
  /// Null-space dimension, floating base not counted; absent unless locked_computed.
  std::optional<int> mobility;
  bool locked_computed = true;  ///< False where a biconnected part has over 500 joints.
};

/// Entries of all lists of adjacent joints together.
inline constexpr int64_t kMaxAdjacencies = 2'000'000;

KinematicGraph BuildKinematicGraph(const Model& model, const Robot& robot);

/// Adds a docking-only view of bodies: the part that needs no constraint analysis.
/// body_of[module][link], numbered by first appearance in (module, link) order.
std::vector<std::vector<int>> BodiesOf(const Model& model, const Robot& robot);

}  // namespace morphbus::model
