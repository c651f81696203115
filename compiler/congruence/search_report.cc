// From a finished correspondence to a Mapping: what nothing settled is set, offsets are read off.

#include <cmath>
#include <numbers>

#include "compiler/congruence/search.h"

namespace morphbus::congruence {
namespace {

uint64_t HashOf(uint64_t hash, uint64_t value) {
  hash ^= value + 0x9e3779b97f4a7c15u + (hash << 6) + (hash >> 2);
  return hash * 0xff51afd7ed558ccdu;
}

}  // namespace

/// Turns that nothing settles: such that offsets become 0, and if all is open, the frame is kept.
void Search::SettleTheRest() {
  const auto settle_neighbours = [this] {
    bool any_open = true;
    bool changed = true;
    while (any_open && changed) {
      any_open = changed = false;
      for (const int body : order_) {
        for (const int joint : a_.bodies[body].joints) {
          const AssemblyJoint& j = a_.joints[joint];
          const int other = j.Other(body);
          if (R_.settled(other)) continue;
          any_open = true;
          if (!R_.settled(body) || j.slide || j.bounded()) continue;
          const AssemblyJoint& to = b_.joints[joint_to_[joint].to];
          const double delta = joint_to_[joint].sign * j.start - to.start;
          changed =
              R_.AlignWhole(other, Turn(to.AxisFrom(body_to_[body]), -delta) * R_.Value(body)) ||
              changed;
        }
      }
    }
  };
  settle_neighbours();
  const int root = a_.body_of[a_.robot->root_module][a_.robot->root_link];
  if (!R_.settled(root) && !R_.AlignWhole(root, Eigen::Matrix3d::Identity())) {
    R_.AlignWhole(root, R_.Value(root));
  }
  settle_neighbours();
  for (const int body : order_) {
    if (!R_.settled(body)) R_.AlignWhole(body, R_.Value(body));
  }
}

double Search::FinalOffset(int joint, const Option& option) const {
  const AssemblyJoint& j = a_.joints[joint];
  const AssemblyJoint& to = b_.joints[option.to];
  if (j.bounded()) return OffsetOfLimits(j, to, option.sign);
  if (j.body_a == j.body_b) return 0.0;
  const int body = j.body_b;
  const int other = j.body_a;
  const int image = body_to_[body];
  const Eigen::Vector3d d_to = to.AxisFrom(image);
  double delta = 0.0;
  if (j.slide) {
    const Eigen::Vector3d apart = a_.bodies[other].p_RoTo - a_.bodies[body].p_RoTo;
    const Eigen::Vector3d apart_image = b_.bodies[body_to_[other]].p_RoTo - b_.bodies[image].p_RoTo;
    delta = option.sign * apart.dot(j.AxisFrom(body)) - apart_image.dot(d_to);
  } else {
    delta = AngleAbout(R_.Value(body) * R_.Value(other).transpose(), d_to);
  }
  double offset = delta + to.start - option.sign * j.start;
  if (!j.slide) offset = std::remainder(offset, 2.0 * std::numbers::pi);
  return std::abs(offset) < 1e-9 ? 0.0 : offset;
}

bool Search::KeepsFrame() const {
  const int root = a_.body_of[a_.robot->root_module][a_.robot->root_link];
  const int root_b = b_.body_of[b_.robot->root_module][b_.robot->root_link];
  if (body_to_[root] != root_b) return false;
  const double turned = (R_.Value(root) - Eigen::Matrix3d::Identity()).norm();
  const double moved = (a_.bodies[root].p_RoTo - b_.bodies[root_b].p_RoTo).norm();
  return turned <= 2.0 * kGeometryTolerance && moved <= length_tolerance_;
}

/// A module goes where all its joints go; one without joints where its origin goes.
std::vector<int> Search::ModuleMap() const {
  const size_t count = a_.robot->modules.size();
  std::vector<int> to(count, -2);
  for (size_t j = 0; j < a_.joints.size(); ++j) {
    int& module = to[a_.joints[j].module];
    const int image = b_.joints[joint_to_[j].to].module;
    module = module == -2 || module == image ? image : -1;
  }
  std::vector<bool> rigid_b(b_.robot->modules.size(), true);
  for (const AssemblyJoint& joint : b_.joints) rigid_b[joint.module] = false;
  for (size_t m = 0; m < count; ++m) {
    if (to[m] != -2) continue;
    to[m] = -1;
    if (a_.body_of[m].empty()) continue;
    const int body = a_.body_of[m][0];
    const int image = body_to_[body];
    const Eigen::Vector3d p = a_.X_RL[m][0].translation() - a_.bodies[body].p_RoTo;
    const Eigen::Vector3d p_image = b_.bodies[image].p_RoTo + R_.Value(body) * p;
    for (const model::LinkRef& link : b_.bodies[image].links) {
      if (!rigid_b[link.module]) continue;
      const Eigen::Vector3d gap = b_.X_RL[link.module][link.link].translation() - p_image;
      if (gap.norm() > length_tolerance_) continue;
      to[m] = link.module;
      rigid_b[link.module] = false;
      break;
    }
  }
  return to;
}

void Search::Report() {
  uint64_t hash = 0;
  for (const int to : body_to_) hash = HashOf(hash, static_cast<uint64_t>(to));
  Mapping mapping;
  mapping.body_to = body_to_;
  for (size_t j = 0; j < joint_to_.size(); ++j) {
    Option option = joint_to_[j];
    const AssemblyJoint& from = a_.joints[j];
    const AssemblyJoint& to = b_.joints[option.to];
    if (from.body_a == from.body_b) {
      // Which way round is open, as it cannot move: such that the limits agree as they are.
      option.sign = !from.bounded() || OffsetOfLimits(from, to, 1.0) == 0.0 ||
                            OffsetOfLimits(from, to, -1.0) != 0.0
                        ? 1.0
                        : -1.0;
    }
    hash = HashOf(hash, static_cast<uint64_t>(option.to) * 2 + (option.sign > 0.0 ? 1 : 0));
    mapping.joints.push_back({option.to, option.sign, 0.0});
  }
  if (!seen_.insert(hash).second) return;
  const PartialRotations::Mark before = R_.mark();
  for (size_t b = 0; b < body_to_.size(); ++b) {
    const int body = static_cast<int>(b);
    const bool open = !R_.settled(body);
    mapping.free_axis.push_back(open ? R_.GroupAxis(body) : Eigen::Vector3d(0, 0, 0));
    mapping.free_group.push_back(open ? R_.GroupOf(body) : -1);
  }
  SettleTheRest();
  for (size_t j = 0; j < joint_to_.size(); ++j) {
    mapping.joints[j].offset =
        FinalOffset(static_cast<int>(j), {mapping.joints[j].to, mapping.joints[j].sign});
  }
  for (size_t b = 0; b < body_to_.size(); ++b) mapping.R.push_back(R_.Value(static_cast<int>(b)));
  mapping.module_to = ModuleMap();
  mapping.keeps_frame = KeepsFrame();
  R_.Undo(before);
  if (!(*found_)(mapping)) stopped_ = true;
}

}  // namespace morphbus::congruence
