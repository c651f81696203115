#pragma once
// Mobility of a graph of rigid bodies and joints, from its loop-closure constraints: the null space
// of their Jacobian, found exactly for each biconnected part.
// The kinematic graph makes the input from a robot (kinematic_graph.cc); a fixed joint or docking
// is no joint here, as it holds two links together in one body.

#include <Eigen/Core>
#include <vector>

namespace morphbus::model {

/// A one-degree-of-freedom joint between two bodies, at one configuration.
/// The bodies are numbered from 0; both ends may be on the same one.
struct ScrewJoint {
  int body_a = 0;
  int body_b = 0;
  bool prismatic = false;
  /// The unit direction of the axis in a frame that all joints share.
  Eigen::Vector3d axis;
  /// A point on the axis in that frame (m).
  Eigen::Vector3d point;
};

/// What ComputeLoopMobility finds.
struct LoopMobility {
  /// The dimension of the null space over all parts that were computed.
  int mobility = 0;
  /// For each joint: true if no motion of the null space moves it.
  std::vector<bool> locked;
  /// False where a biconnected part has over kMaxLoopJoints joints.
  bool computed = true;
};

/// Above this many joints in one biconnected part, locking is said to be not computed.
inline constexpr int kMaxLoopJoints = 500;

/// The mobility at the configuration given: how many independent motions the joints allow, the
/// floating base not counted. A joint outside of all loops adds one.
/// Rank tolerance 1e-9, lengths scaled by the spread of the axes, so that units do not matter.
LoopMobility ComputeLoopMobility(int num_bodies, const std::vector<ScrewJoint>& joints);

/// Joint indices of each biconnected part (block) of the multigraph, smallest joint first.
/// Two joints are in one part if some loop without repeated bodies runs through both, which lets
/// the parts be analysed one by one. A joint in no loop is a part by itself.
std::vector<std::vector<int>> BiconnectedParts(int num_bodies,
                                               const std::vector<ScrewJoint>& joints);

}  // namespace morphbus::model
