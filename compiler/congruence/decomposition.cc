#include "compiler/congruence/decomposition.h"

#include <algorithm>
#include <numeric>

#include "compiler/congruence/classes.h"
#include "compiler/model/loop_constraints.h"

namespace morphbus::congruence {
namespace {

bool WithinOneBody(const ScrewJoint& joint) { return joint.body_a == joint.body_b; }

/// Do all joints of the body have one axis, through its reference point? True of no joints.
bool IsCoaxial(const ScrewGraph& graph, int body, double length_tolerance) {
  const std::vector<int>& joints = graph.bodies[body].joints;
  return std::all_of(joints.begin(), joints.end(), [&](int joint) {
    const ScrewJoint& j = graph.joints[joint];
    if (j.axis.cross(graph.joints[joints[0]].axis).norm() > kGeometryTolerance) return false;
    const Eigen::Vector3d out =
        j.slide ? OffsetAcrossSlide(graph, body, joint) : graph.FootFrom(body, joint);
    return out.norm() <= length_tolerance;
  });
}

/// Sorts numbers and removes those that stand there twice.
void SortUnique(std::vector<int>& numbers) {
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
}

/// Joins biconnected parts that can tell each other, through a coaxial body, how far it is turned.
/// A union-find over the parts.
class PartJoiner {
 public:
  PartJoiner(const ScrewGraph& graph, const std::vector<std::vector<int>>& parts,
             const std::vector<bool>& coaxial)
      : graph_(graph), parts_(parts), coaxial_(coaxial), parent_(parts.size()) {
    // At first each part is a piece of its own.
    std::iota(parent_.begin(), parent_.end(), 0);
    parts_at_.resize(graph.bodies.size());
    for (size_t p = 0; p < parts.size(); ++p) {
      for (const int joint : parts[p]) {
        parts_at_[graph.joints[joint].body_a].push_back(static_cast<int>(p));
        parts_at_[graph.joints[joint].body_b].push_back(static_cast<int>(p));
      }
    }
    for (std::vector<int>& at : parts_at_) SortUnique(at);
  }

  /// By part: one part that stands for the piece it belongs to.
  std::vector<int> Join() {
    for (size_t b = 0; b < parts_at_.size(); ++b) {
      if (!coaxial_[b] || parts_at_[b].size() < 2) continue;
      // All parts here that can fix the body's turn have to agree on it, so they are one piece.
      int first = -1;
      for (const int part : parts_at_[b]) {
        if (!CanFixTurn(static_cast<int>(b), part, 0)) continue;
        if (first >= 0) parent_[Find(part)] = Find(first);
        first = part;
      }
    }
    std::vector<int> piece_of;
    for (size_t p = 0; p < parts_.size(); ++p) piece_of.push_back(Find(static_cast<int>(p)));
    return piece_of;
  }

 private:
  int Find(int part) {
    while (parent_[part] != part) part = parent_[part] = parent_[parent_[part]];
    return part;
  }

  /// Can `part` fix how far the coaxial `body` is turned? When in doubt the answer is yes, which
  /// makes larger pieces and never a wrong answer.
  [[nodiscard]] bool CanFixTurn(int body, int part, int depth) const {
    constexpr int kMaxDepth = 200;
    const std::vector<int>& joints = parts_[part];
    if (joints.size() > 1 || depth > kMaxDepth) return true;
    // A joint that turns without limits says nothing of how far its ends are turned.
    const ScrewJoint& j = graph_.joints[joints[0]];
    if (!j.slide && !j.bounded()) return false;
    // Any other passes on what is known at its far end: all, or what the parts beyond can fix.
    const int other = j.Other(body);
    if (!coaxial_[other]) return true;
    const std::vector<int>& beyond = parts_at_[other];
    return std::any_of(beyond.begin(), beyond.end(), [&](int next) {
      return next != part && CanFixTurn(other, next, depth + 1);
    });
  }

  const ScrewGraph& graph_;
  const std::vector<std::vector<int>>& parts_;
  const std::vector<bool>& coaxial_;
  std::vector<int> parent_;
  std::vector<std::vector<int>> parts_at_;  ///< By body.
};

std::vector<bool> CoaxialBodies(const ScrewGraph& graph, double length_tolerance) {
  std::vector<bool> coaxial;
  for (size_t b = 0; b < graph.bodies.size(); ++b) {
    coaxial.push_back(IsCoaxial(graph, static_cast<int>(b), length_tolerance));
  }
  return coaxial;
}

/// The decomposition into pieces that have these joints.
Decomposition FromJoints(const ScrewGraph& graph, std::vector<std::vector<int>> joints,
                         std::vector<bool> coaxial) {
  Decomposition pieces;
  pieces.joints = std::move(joints);
  pieces.coaxial = std::move(coaxial);
  pieces.bodies.resize(pieces.joints.size());
  pieces.of_joint.assign(graph.joints.size(), -1);
  pieces.at_body.resize(graph.bodies.size());
  for (size_t p = 0; p < pieces.joints.size(); ++p) {
    std::vector<int>& bodies = pieces.bodies[p];
    for (const int joint : pieces.joints[p]) {
      pieces.of_joint[joint] = static_cast<int>(p);
      bodies.push_back(graph.joints[joint].body_a);
      bodies.push_back(graph.joints[joint].body_b);
    }
    // A body that several joints touch stands there once.
    SortUnique(bodies);
    for (const int body : bodies) pieces.at_body[body].push_back(static_cast<int>(p));
  }
  return pieces;
}

}  // namespace

Eigen::Vector3d OffsetAcrossSlide(const ScrewGraph& graph, int body, int joint) {
  const ScrewJoint& j = graph.joints[joint];
  const Eigen::Vector3d apart = graph.bodies[j.Other(body)].p_RoTo - graph.bodies[body].p_RoTo;
  return apart - apart.dot(j.axis) * j.axis;
}

Decomposition AsOnePiece(const ScrewGraph& graph, double length_tolerance) {
  // All joints, those within a body too.
  std::vector<int> all(graph.joints.size());
  std::iota(all.begin(), all.end(), 0);
  return FromJoints(graph, {all}, CoaxialBodies(graph, length_tolerance));
}

Decomposition Decompose(const ScrewGraph& graph, double length_tolerance) {
  // The biconnected parts, without those of a joint that both ends of are in one body.
  std::vector<std::vector<int>> parts =
      model::BiconnectedParts(static_cast<int>(graph.bodies.size()), ScrewJointsOf(graph));
  parts.erase(std::remove_if(parts.begin(), parts.end(),
                             [&](const std::vector<int>& part) {
                               return WithinOneBody(graph.joints[part[0]]);
                             }),
              parts.end());

  // Parts that have one stand-in make one piece; pieces are numbered by their first part.
  std::vector<bool> coaxial = CoaxialBodies(graph, length_tolerance);
  const std::vector<int> stand_in = PartJoiner(graph, parts, coaxial).Join();
  std::vector<int> piece_of(parts.size(), -1);
  std::vector<std::vector<int>> joints;
  for (size_t p = 0; p < parts.size(); ++p) {
    int& piece = piece_of[stand_in[p]];
    if (piece < 0) {
      piece = static_cast<int>(joints.size());
      joints.emplace_back();
    }
    joints[piece].insert(joints[piece].end(), parts[p].begin(), parts[p].end());
  }
  return FromJoints(graph, std::move(joints), std::move(coaxial));
}

}  // namespace morphbus::congruence
