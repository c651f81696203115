#include "compiler/model/loop_constraints.h"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <deque>
#include <map>
#include <utility>

namespace morphbus::model {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;

/// A joint as one of its bodies sees it.
struct Incident {
  int joint;
  int body;  ///< At the other end.
};

/// Tarjan's algorithm with an explicit stack (a robot may be a chain of any length).
class BlockFinder {
 public:
  BlockFinder(int num_bodies, const std::vector<ScrewJoint>& joints)
      : at_(num_bodies), depth_(num_bodies, -1), low_(num_bodies, 0), used_(joints.size(), false) {
    for (int j = 0; j < std::ssize(joints); ++j) {
      const auto& [body_a, body_b] = std::pair(joints[j].body_a, joints[j].body_b);
      at_[body_a].push_back({j, body_b});
      if (body_b != body_a) at_[body_b].push_back({j, body_a});
    }
    // Every connected part is searched from its first body.
    for (int body = 0; body < num_bodies; ++body) {
      if (depth_[body] < 0) Visit(body);
    }
    for (std::vector<int>& block : blocks_) std::sort(block.begin(), block.end());
    std::sort(blocks_.begin(), blocks_.end());
  }

  std::vector<std::vector<int>> Take() { return std::move(blocks_); }

 private:
  struct Frame {
    int body;
    int via;  ///< Joint that led here, -1 at the start.
    size_t next = 0;
  };

  /// Depth-first search over one connected part, which cuts off a block at each return over an
  /// articulation.
  void Visit(int start) {
    std::vector<Frame> stack;
    Enter(start, -1, stack);
    // The search goes one joint further, or back where a body has no more joints.
    while (!stack.empty()) {
      Frame& frame = stack.back();
      if (frame.next == at_[frame.body].size()) {
        const Frame done = frame;
        // The copy outlives the frame, since Leave must know by which joint the body was entered.
        stack.pop_back();
        if (!stack.empty()) Leave(done, stack.back().body);
        continue;
      }
      const Incident edge = at_[frame.body][frame.next++];
      if (used_[edge.joint]) continue;
      used_[edge.joint] = true;
      if (edge.body == frame.body) {
        blocks_.push_back({edge.joint});  // both ends on one body: a loop by itself
        continue;
      }
      open_.push_back(edge.joint);
      if (depth_[edge.body] < 0) {
        Enter(edge.body, edge.joint, stack);
      } else {
        // A joint back to a body that is open: from here the walk can return to that depth.
        low_[frame.body] = std::min(low_[frame.body], depth_[edge.body]);
      }
    }
  }

  /// Opens a body: it is at the top of the stack now.
  void Enter(int body, int via, std::vector<Frame>& stack) {
    depth_[body] = low_[body] = static_cast<int>(stack.size());
    stack.push_back({body, via});
  }

  /// Closes a body. If nothing below it reaches above its parent, the joints since it was opened
  /// are one block.
  void Leave(const Frame& child, int parent) {
    // What the child reaches, its parent reaches too.
    low_[parent] = std::min(low_[parent], low_[child.body]);
    // Something below the child leads above the parent: the block goes on.
    if (low_[child.body] < depth_[parent]) return;
    std::vector<int> block;
    int joint = -1;
    do {
      joint = open_.back();
      open_.pop_back();
      block.push_back(joint);
    } while (joint != child.via);
    blocks_.push_back(std::move(block));
  }

  std::vector<std::vector<Incident>> at_;  ///< The joints at each body.
  std::vector<int> depth_;
  std::vector<int> low_;
  std::vector<bool> used_;
  std::vector<int> open_;  ///< Joints of blocks not finished yet.
  std::vector<std::vector<int>> blocks_;
};

/// The joint's unit twist of A relative to B, moments about `centre` and in units of `length`.
Eigen::Matrix<double, 6, 1> Screw(const ScrewJoint& joint, const Vector3d& centre, double length) {
  Eigen::Matrix<double, 6, 1> screw;
  if (joint.prismatic) {
    screw << Vector3d::Zero(), joint.axis;
  } else {
    screw << joint.axis, (joint.point - centre).cross(joint.axis) / length;
  }
  return screw;
}

/// One block's closure Jacobian: six rows for each joint outside a spanning tree, a column a joint.
MatrixXd ClosureJacobian(const std::vector<int>& block, const std::vector<ScrewJoint>& joints) {
  // Moments are taken about the middle of the block and in units of its size, so that ranks do not
  // depend on where it lies or in which unit it is drawn.
  Vector3d centre = Vector3d::Zero();
  for (const int j : block) centre += joints[j].point / static_cast<double>(block.size());
  double length = 0.0;
  for (const int j : block) length = std::max(length, (joints[j].point - centre).norm());
  if (length <= 0.0) length = 1.0;

  // The graph of this block alone is needed, whose bodies may have any numbers.
  std::map<int, std::vector<std::pair<int, int>>> at;  // body -> (column, other body)
  for (size_t k = 0; k < block.size(); ++k) {
    const ScrewJoint& joint = joints[block[k]];
    at[joint.body_a].emplace_back(static_cast<int>(k), joint.body_b);
    at[joint.body_b].emplace_back(static_cast<int>(k), joint.body_a);
  }
  // Breadth-first tree; climb[body] is the way to the root.
  struct Climb {
    int column = -1;
    int parent = -1;
    int depth = 0;
  };
  const int root = at.begin()->first;
  std::map<int, Climb> climb = {{root, {}}};
  std::vector<bool> in_tree(block.size(), false);
  for (std::deque<int> queue = {root}; !queue.empty(); queue.pop_front()) {
    const int body = queue.front();
    for (const auto& [column, other] : at[body]) {
      if (climb.count(other) > 0) continue;
      climb[other] = {column, body, climb[body].depth + 1};
      in_tree[column] = true;
      queue.push_back(other);
    }
  }
  // Each joint outside of the tree closes one loop, which gives six equations.
  const auto num_loops = std::count(in_tree.begin(), in_tree.end(), false);
  MatrixXd J = MatrixXd::Zero(6 * num_loops, static_cast<Eigen::Index>(block.size()));
  Eigen::Index row = 0;
  for (size_t k = 0; k < block.size(); ++k) {
    if (in_tree[k]) continue;
    // Along the loop every joint contributes its twist, with the sense it is passed in.
    const auto add = [&](int column, int from) {
      const ScrewJoint& joint = joints[block[column]];
      const double sense = from == joint.body_b ? 1.0 : -1.0;
      J.block<6, 1>(row, column) += sense * Screw(joint, centre, length);
    };
    const ScrewJoint& closing = joints[block[k]];
    add(static_cast<int>(k), closing.body_b);
    // From both ends of the closing joint up to where their ways to the root meet.
    int up = closing.body_a;
    int down = closing.body_b;
    while (up != down) {
      if (climb[up].depth >= climb[down].depth) {
        add(climb[up].column, up);
        up = climb[up].parent;
      } else {
        add(climb[down].column, climb[down].parent);
        down = climb[down].parent;
      }
    }
    row += 6;
  }
  return J;
}

}  // namespace

std::vector<std::vector<int>> BiconnectedParts(int num_bodies,
                                               const std::vector<ScrewJoint>& joints) {
  return BlockFinder(num_bodies, joints).Take();
}

LoopMobility ComputeLoopMobility(int num_bodies, const std::vector<ScrewJoint>& joints) {
  constexpr double kRankTolerance = 1e-9;
  // The null space's basis is orthonormal; a joint that moves at all shows at about 1/sqrt(joints),
  // rounding at about 1e-16 / kRankTolerance.
  constexpr double kStill = 1e-6;
  LoopMobility result;
  result.locked.assign(joints.size(), false);
  for (const std::vector<int>& block : BiconnectedParts(num_bodies, joints)) {
    const int size = static_cast<int>(block.size());
    const ScrewJoint& first = joints[block[0]];
    // The blocks do not share any loop, so each is computed for itself.
    if (size == 1 && first.body_a != first.body_b) {
      ++result.mobility;  // a bridge: no loop runs through it
      continue;
    }
    // A large block would take cubic time; what is known of the others still counts.
    if (size > kMaxLoopJoints) {
      result.computed = false;
      continue;
    }
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> cod;
    cod.setThreshold(kRankTolerance);
    cod.compute(ClosureJacobian(block, joints));
    // The null space of the closure equations is what can move.
    const Eigen::Index free = size - cod.rank();
    result.mobility += static_cast<int>(free);
    if (free == 0) {
      for (const int joint : block) result.locked[joint] = true;
      continue;
    }
    // A joint is locked if it has no part in any motion of the null space.
    const MatrixXd null_space = cod.colsPermutation() * cod.matrixZ().transpose().rightCols(free);
    for (int k = 0; k < size; ++k) {
      if (null_space.row(k).norm() <= kStill) result.locked[block[k]] = true;
    }
  }
  return result;
}

}  // namespace morphbus::model
