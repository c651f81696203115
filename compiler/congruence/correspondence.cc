#include "compiler/congruence/correspondence.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "compiler/base/check.h"

namespace morphbus::congruence {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

/// Offsets (rad, m) are known no better than this.
constexpr double kRounding = 1e-9;

}  // namespace

Correspondence::Correspondence(const ScrewGraph& a, const ScrewGraph& b, Classes classes)
    : a_(a),
      b_(b),
      classes_(std::move(classes)),
      length_tolerance_(LengthTolerance(a, b)),
      slide_tolerance_(SlideTolerance(a, b)),
      R_(a.bodies.size(), {length_tolerance_, kGeometryTolerance}),
      body_to_(a.bodies.size(), -1),
      body_from_(b.bodies.size(), -1),
      joint_to_(a.joints.size(), JointImage{-1, 1.0}),
      joint_from_(b.joints.size(), -1) {}

void Correspondence::Undo(const Mark& mark) {
  // Counterparts forget each other, the latest first; rotations have a trail of their own.
  for (; joints_order_.size() > mark.joints; joints_order_.pop_back()) {
    JointImage& counterpart = joint_to_[joints_order_.back()];
    joint_from_[counterpart.to] = -1;
    counterpart.to = -1;
  }
  for (; order_.size() > mark.bodies; order_.pop_back()) {
    const int body = order_.back();
    body_from_[body_to_[body]] = -1;
    body_to_[body] = -1;
  }
  R_.Undo(mark.rotations);
}

void Correspondence::MatchBodies(int body, int image) {
  body_to_[body] = image;
  body_from_[image] = body;
  order_.push_back(body);
}

bool Correspondence::SameRange(int joint, int to) const {
  const ScrewJoint& from = a_.joints[joint];
  const ScrewJoint& image = b_.joints[to];
  if (from.slide != image.slide || from.bounded() != image.bounded()) return false;
  const double difference = (from.upper - from.lower) - (image.upper - image.lower);
  return !from.bounded() || std::abs(difference) <= RangeTolerance(from);
}

void Correspondence::AddCounterparts(int body, int joint, int to,
                                     std::vector<JointImage>& counterparts) {
  if (joint_from_[to] >= 0 || !MayCorrespond(joint, to)) return;
  // The bodies beyond must both be the one the joint began at, or matched, or free.
  const int image = body_to_[body];
  const int other = a_.joints[joint].Other(body);
  const int other_image = b_.joints[to].Other(image);
  if ((other == body) != (other_image == image)) return;
  if (body_to_[other] >= 0 ? body_to_[other] != other_image : body_from_[other_image] >= 0) return;
  // They must be in one class too. Where the rotation is open that is left for later: an attempt
  // that goes on says more to a person than one that ends at its first joint.
  const bool same_class = classes_.bodies[0][other] == classes_.bodies[1][other_image];
  if (R_.settled(body) && !same_class) return;
  for (const double sign : {1.0, -1.0}) {
    // Where the rotation is known this leaves most joints one counterpart.
    const bool in_place = !R_.settled(body) || AlignJoint(body, joint, {to, sign});
    if (in_place) counterparts.push_back({to, sign});
  }
}

// --- From a finished correspondence to a Mapping -----------------------------------------------

/// Settles bodies at joints that turn without limits as their settled neighbours are, such that
/// those joints' offsets become 0; on and on, until that reaches no further.
void Correspondence::SettleNeighbours() {
  bool any_open = true;
  bool changed = true;
  while (any_open && changed) {
    any_open = changed = false;
    for (const int body : order_) {
      for (const int joint : a_.bodies[body].joints) {
        const ScrewJoint& j = a_.joints[joint];
        if (R_.settled(j.Other(body))) continue;
        any_open = true;
        // Only a joint without limits leaves its offset open.
        if (!R_.settled(body) || j.slide || j.bounded()) continue;
        const JointPair pair = PairOf(body, joint, joint_to_[joint]);
        // With the offset o = 0 in delta = s q_start + o - q'_start, the other body is turned by
        // -delta about the joint's axis (head of correspondence_commit.cc).
        const double delta = pair.counterpart.sign * pair.joint.start - pair.to.start;
        const Matrix3d wanted = Turn(pair.to_axis, -delta) * R_.Value(body);
        changed = R_.AlignWhole(pair.other, wanted) || changed;
      }
    }
  }
}

/// Chooses the turns that nothing determines: such that offsets become 0 where they can, and the
/// robot frame is kept if that is open too.
void Correspondence::SettleTheRest() {
  SettleNeighbours();
  const int root = a_.RootBody();
  // Bodies that hang on settled ones first, then the root as it is, if that is allowed, then what
  // hangs on the root; what is left stays as it happens to be.
  if (!R_.settled(root) && !R_.AlignWhole(root, Eigen::Matrix3d::Identity())) {
    R_.AlignWhole(root, R_.Value(root));
  }
  SettleNeighbours();
  for (const int body : order_) {
    if (!R_.settled(body)) R_.AlignWhole(body, R_.Value(body));
  }
}

double Correspondence::FinalOffset(int joint, const JointImage& counterpart) const {
  const JointPair pair = PairOf(a_.joints[joint].body_b, joint, counterpart);
  const double of_limits = OffsetOfLimits(joint, counterpart);
  if (pair.other == pair.body) return of_limits;
  const double offset = OffsetOf(pair);
  // Free of rounding where the limits say it to the last digit.
  return std::abs(offset - of_limits) < kRounding ? of_limits : offset;
}

bool Correspondence::KeepsFrame() const {
  const int root = a_.RootBody();
  const int root_b = b_.RootBody();
  if (body_to_[root] != root_b) return false;
  const double turned = (R_.Value(root) - Eigen::Matrix3d::Identity()).norm();
  const double moved = (a_.bodies[root].p_RoTo - b_.bodies[root_b].p_RoTo).norm();
  return turned <= 2.0 * kGeometryTolerance && moved <= length_tolerance_;
}

/// By module of a the module of b it goes to: where all its joints go or, for one without joints,
/// where its origin goes. -1 where its joints go to several.
std::vector<int> Correspondence::ModuleMap() const {
  constexpr int kNoJoint = -2;
  std::vector<int> to(a_.robot->modules.size(), kNoJoint);
  for (size_t j = 0; j < a_.joints.size(); ++j) {
    int& module = to[a_.joints[j].module];
    const int image = b_.joints[joint_to_[j].to].module;
    module = module == kNoJoint || module == image ? image : -1;
  }
  std::vector<bool> free_b(b_.robot->modules.size(), true);
  for (const ScrewJoint& joint : b_.joints) free_b[joint.module] = false;
  for (size_t m = 0; m < to.size(); ++m) {
    if (to[m] == kNoJoint) to[m] = ImageOfRigidModule(static_cast<int>(m), free_b);
  }
  return to;
}

/// Of the modules of b marked in `free_b` (those without joints that are no image yet) the one
/// whose origin is where that of `module` goes, which is then not free any more; -1 if none.
int Correspondence::ImageOfRigidModule(int module, std::vector<bool>& free_b) const {
  if (a_.body_of[module].empty()) return -1;
  const int body = a_.body_of[module][0];
  const int image = body_to_[body];
  const Eigen::Vector3d p = a_.X_RL[module][0].translation() - a_.bodies[body].p_RoTo;
  const Eigen::Vector3d p_image = b_.bodies[image].p_RoTo + R_.Value(body) * p;
  for (const model::LinkRef& link : b_.bodies[image].links) {
    if (!free_b[link.module]) continue;
    const Eigen::Vector3d gap = b_.X_RL[link.module][link.link].translation() - p_image;
    if (gap.norm() > length_tolerance_) continue;
    free_b[link.module] = false;
    return link.module;
  }
  return -1;
}

/// The sign of a joint with both ends in one body, which may go either way round: that under which
/// its limits agree as they are, if there is one.
double Correspondence::SignWithin(int joint, int to) const {
  double best = 0.0;
  for (const double sign : {1.0, -1.0}) {
    if (!LockedValueFits(joint, {to, sign})) continue;
    if (OffsetOfLimits(joint, {to, sign}) == 0.0) return sign;
    if (best == 0.0) best = sign;
  }
  return best == 0.0 ? 1.0 : best;
}

Mapping Correspondence::ToMapping() {
  // A search along joints reaches every body, as robots hang together.
  MORPHBUS_CHECK(order_.size() == a_.bodies.size() && joints_order_.size() == a_.joints.size());
  Mapping mapping;
  mapping.body_to = body_to_;
  mapping.joints = joint_to_;
  for (size_t j = 0; j < joint_to_.size(); ++j) {
    if (a_.joints[j].body_a != a_.joints[j].body_b) continue;
    mapping.joints[j].sign = SignWithin(static_cast<int>(j), joint_to_[j].to);
  }

  // What is free is said before one choice of it is made.
  const PartialRotations::Mark before = R_.mark();
  for (size_t b = 0; b < body_to_.size(); ++b) {
    const int body = static_cast<int>(b);
    const bool open = !R_.settled(body);
    mapping.free_axis.push_back(open ? R_.GroupAxis(body) : Eigen::Vector3d(0, 0, 0));
    mapping.free_group.push_back(open ? R_.GroupOf(body) : -1);
  }
  SettleTheRest();
  for (size_t j = 0; j < joint_to_.size(); ++j) {
    mapping.joints[j].offset = FinalOffset(static_cast<int>(j), mapping.joints[j]);
  }
  for (size_t b = 0; b < body_to_.size(); ++b) mapping.R.push_back(R_.Value(static_cast<int>(b)));
  mapping.module_to = ModuleMap();
  mapping.keeps_frame = KeepsFrame();
  R_.Undo(before);
  return mapping;
}

}  // namespace morphbus::congruence
