// From a finished correspondence to a Mapping: what nothing settled is set, offsets are read off.

#include <cmath>

#include "compiler/congruence/correspondence.h"

namespace morphbus::congruence {
namespace {

/// Offsets (rad, m) are known no better than this.
constexpr double kRounding = 1e-9;

}  // namespace

/// Turns that nothing settles: such that offsets become 0, and if all is open, the frame is kept.
void Correspondence::SettleTheRest() {
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

double Correspondence::FinalOffset(int joint, const Option& option) const {
  const AssemblyJoint& j = a_.joints[joint];
  const AssemblyJoint& to = b_.joints[option.to];
  const double of_limits = j.bounded() ? OffsetOfLimits(j, to, option.sign, slide_tolerance_) : 0.0;
  if (j.body_a == j.body_b) return of_limits;
  double offset = 0.0;
  if (j.slide) {
    const int image = body_to_[j.body_b];
    const Eigen::Vector3d apart = a_.bodies[j.body_a].p_RoTo - a_.bodies[j.body_b].p_RoTo;
    const Eigen::Vector3d apart_image =
        b_.bodies[body_to_[j.body_a]].p_RoTo - b_.bodies[image].p_RoTo;
    const double delta =
        option.sign * apart.dot(j.AxisFrom(j.body_b)) - apart_image.dot(to.AxisFrom(image));
    offset = delta + to.start - option.sign * j.start;
  } else {
    offset = OffsetOf(joint, option);
  }
  // Free of rounding where the limits say it to the last digit.
  return std::abs(offset - of_limits) < kRounding ? of_limits : offset;
}

bool Correspondence::KeepsFrame() const {
  const int root = a_.body_of[a_.robot->root_module][a_.robot->root_link];
  const int root_b = b_.body_of[b_.robot->root_module][b_.robot->root_link];
  if (body_to_[root] != root_b) return false;
  const double turned = (R_.Value(root) - Eigen::Matrix3d::Identity()).norm();
  const double moved = (a_.bodies[root].p_RoTo - b_.bodies[root_b].p_RoTo).norm();
  return turned <= 2.0 * kGeometryTolerance && moved <= length_tolerance_;
}

/// A module goes where all its joints go; one without joints where its origin goes.
std::vector<int> Correspondence::ModuleMap() const {
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

/// A joint with both ends in one body may go either way round: such that its limits agree as they
/// are, if that can be had.
double Correspondence::StillSign(int joint, int to) const {
  const AssemblyJoint& from = a_.joints[joint];
  double best = 0.0;
  for (const double sign : {1.0, -1.0}) {
    if (!StillFits(joint, {to, sign})) continue;
    const bool as_it_is =
        !from.bounded() || OffsetOfLimits(from, b_.joints[to], sign, slide_tolerance_) == 0.0;
    if (as_it_is) return sign;
    if (best == 0.0) best = sign;
  }
  return best == 0.0 ? 1.0 : best;
}

Mapping Correspondence::ToMapping() {
  Mapping mapping;
  mapping.body_to = body_to_;
  for (size_t j = 0; j < joint_to_.size(); ++j) {
    Option option = joint_to_[j];
    if (a_.joints[j].body_a == a_.joints[j].body_b) {
      option.sign = StillSign(static_cast<int>(j), option.to);
    }
    mapping.joints.push_back({option.to, option.sign, 0.0});
  }
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
  return mapping;
}

}  // namespace morphbus::congruence
