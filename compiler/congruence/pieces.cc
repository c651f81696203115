#include "compiler/congruence/pieces.h"

#include <algorithm>
#include <numeric>

#include "compiler/congruence/classes.h"
#include "compiler/model/loop_constraints.h"

namespace morphbus::congruence {
namespace {

bool IsLoose(const Assembly& assembly, int body, double length_tolerance) {
  const std::vector<int>& joints = assembly.bodies[body].joints;
  return std::all_of(joints.begin(), joints.end(), [&](int joint) {
    const AssemblyJoint& j = assembly.joints[joint];
    if (j.axis.cross(assembly.joints[joints[0]].axis).norm() > kGeometryTolerance) return false;
    const Eigen::Vector3d out =
        j.slide ? AcrossFrom(assembly, body, joint) : assembly.FootFrom(body, joint);
    return out.norm() <= length_tolerance;
  });
}

/// Joins biconnected parts to pieces.
class Joiner {
 public:
  Joiner(const Assembly& assembly, const std::vector<std::vector<int>>& parts,
         const std::vector<bool>& loose)
      : assembly_(assembly), parts_(parts), loose_(loose), piece_(parts.size()) {
    std::iota(piece_.begin(), piece_.end(), 0);
    at_body_.resize(assembly.bodies.size());
    for (size_t p = 0; p < parts.size(); ++p) {
      for (const int joint : parts[p]) {
        for (const int body : {assembly.joints[joint].body_a, assembly.joints[joint].body_b}) {
          std::vector<int>& at = at_body_[body];
          if (at.empty() || at.back() != static_cast<int>(p)) at.push_back(static_cast<int>(p));
        }
      }
    }
    for (std::vector<int>& at : at_body_) {
      std::sort(at.begin(), at.end());
      at.erase(std::unique(at.begin(), at.end()), at.end());
    }
  }

  /// For each part the piece that it belongs to, by one of its parts.
  std::vector<int> Join() {
    for (size_t b = 0; b < at_body_.size(); ++b) {
      if (!loose_[b] || at_body_[b].size() < 2) continue;
      int first = -1;
      for (const int part : at_body_[b]) {
        if (!Tells(static_cast<int>(b), part, 0)) continue;
        if (first >= 0) piece_[Find(part)] = Find(first);
        first = part;
      }
    }
    std::vector<int> result;
    for (size_t p = 0; p < parts_.size(); ++p) result.push_back(Find(static_cast<int>(p)));
    return result;
  }

 private:
  int Find(int part) {
    while (piece_[part] != part) part = piece_[part] = piece_[piece_[part]];
    return part;
  }

  /// Could `part` tell loose `body` how far it is turned? Yes is always safe.
  [[nodiscard]] bool Tells(int body, int part, int depth) const {
    constexpr int kMaxDepth = 200;
    const std::vector<int>& joints = parts_[part];
    if (joints.size() > 1 || depth > kMaxDepth) return true;
    const AssemblyJoint& j = assembly_.joints[joints[0]];
    if (!j.slide && !j.bounded()) return false;
    const int other = j.Other(body);
    if (!loose_[other]) return true;
    const std::vector<int>& further = at_body_[other];
    return std::any_of(further.begin(), further.end(),
                       [&](int next) { return next != part && Tells(other, next, depth + 1); });
  }

  const Assembly& assembly_;
  const std::vector<std::vector<int>>& parts_;
  const std::vector<bool>& loose_;
  std::vector<int> piece_;
  std::vector<std::vector<int>> at_body_;
};

}  // namespace

Eigen::Vector3d AcrossFrom(const Assembly& assembly, int body, int joint) {
  const AssemblyJoint& j = assembly.joints[joint];
  const Eigen::Vector3d apart =
      assembly.bodies[j.Other(body)].p_RoTo - assembly.bodies[body].p_RoTo;
  return apart - apart.dot(j.axis) * j.axis;
}

Pieces CutIntoPieces(const Assembly& assembly, double length_tolerance) {
  Pieces pieces;
  for (size_t b = 0; b < assembly.bodies.size(); ++b) {
    pieces.loose.push_back(IsLoose(assembly, static_cast<int>(b), length_tolerance));
  }
  std::vector<std::vector<int>> parts =
      model::BiconnectedParts(static_cast<int>(assembly.bodies.size()), ScrewJointsOf(assembly));
  const auto still = [&](const std::vector<int>& part) {
    return assembly.joints[part[0]].body_a == assembly.joints[part[0]].body_b;
  };
  parts.erase(std::remove_if(parts.begin(), parts.end(), still), parts.end());
  const std::vector<int> piece_of = Joiner(assembly, parts, pieces.loose).Join();

  std::vector<int> number(parts.size(), -1);
  pieces.of_joint.assign(assembly.joints.size(), -1);
  pieces.at_body.resize(assembly.bodies.size());
  for (size_t p = 0; p < parts.size(); ++p) {
    int& piece = number[piece_of[p]];
    if (piece < 0) {
      piece = static_cast<int>(pieces.joints.size());
      pieces.joints.emplace_back();
      pieces.bodies.emplace_back();
    }
    for (const int joint : parts[p]) {
      pieces.joints[piece].push_back(joint);
      pieces.of_joint[joint] = piece;
      const AssemblyJoint& j = assembly.joints[joint];
      for (const int body : {j.body_a, j.body_b}) pieces.bodies[piece].push_back(body);
    }
  }
  for (size_t p = 0; p < pieces.joints.size(); ++p) {
    std::vector<int>& bodies = pieces.bodies[p];
    std::sort(bodies.begin(), bodies.end());
    bodies.erase(std::unique(bodies.begin(), bodies.end()), bodies.end());
    for (const int body : bodies) pieces.at_body[body].push_back(static_cast<int>(p));
  }
  return pieces;
}

}  // namespace morphbus::congruence
