#pragma once
// Mobility of a graph of rigid bodies and joints, from its loop-closure constraints: the null space
// of their Jacobian, found exactly for each biconnected part.

#include <Eigen/Core>
#include <vector>

namespace morphbus::model {

/// A one-degree-of-freedom joint between two bodies, at one configuration.
struct ScrewJoint {
  int body_a = 0;
  int body_b = 0;
  bool prismatic = false;
  Eigen::Vector3d axis;   ///< Unit, common frame.
  Eigen::Vector3d point;  ///< On the axis, common frame (m).
};

struct LoopMobility {
  int mobility = 0;          ///< Dimension of the null space over the parts that were computed.
  std::vector<bool> locked;  ///< For each joint: no motion of the null space moves it.
  bool computed = true;      ///< False where a biconnected part has over kMaxLoopJoints joints.
};

/// Above this many joints in one biconnected part, locking is said to be not computed.
inline constexpr int kMaxLoopJoints = 500;

/// Mobility at the configuration given, floating base not counted. Joints outside loops are free.
/// Rank tolerance 1e-9, lengths scaled by the spread of the axes, so that units do not matter.
LoopMobility ComputeLoopMobility(int num_bodies, const std::vector<ScrewJoint>& joints);

/// Joint indices of each biconnected part (block) of the multigraph, smallest joint first.
std::vector<std::vector<int>> BiconnectedParts(int num_bodies,
                                               const std::vector<ScrewJoint>& joints);

}  // namespace morphbus::model
