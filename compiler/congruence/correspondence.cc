#include "compiler/congruence/correspondence.h"

#include <algorithm>
#include <utility>

namespace morphbus::congruence {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Correspondence::Correspondence(const ScrewGraph& a, const ScrewGraph& b, Classes classes)
    : a_(a),
      b_(b),
      classes_(std::move(classes)),
      length_tolerance_(LengthTolerance(a, b)),
      slide_tolerance_(SlideTolerance(a, b)),
      R_(a.bodies.size(), {length_tolerance_, kGeometryTolerance}),
      body_to_(a.bodies.size(), -1),
      body_from_(b.bodies.size(), -1),
      joint_to_(a.joints.size(), Counterpart{-1, 1.0}),
      joint_from_(b.joints.size(), -1) {}

void Correspondence::Undo(const Mark& mark) {
  // Counterparts forget each other, the latest first; rotations have a trail of their own.
  for (; joints_order_.size() > mark.joints; joints_order_.pop_back()) {
    Counterpart& counterpart = joint_to_[joints_order_.back()];
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

bool Correspondence::MayCorrespond(int joint, int to) const {
  return classes_.joints[0][joint] == classes_.joints[1][to] &&
         SameRange(a_.joints[joint], b_.joints[to], slide_tolerance_);
}

void Correspondence::AddCounterparts(int body, int joint, int to,
                                     std::vector<Counterpart>& counterparts) const {
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
    if (AxisInPlace(body, joint, {to, sign})) counterparts.push_back({to, sign});
  }
}

/// Is the counterpart's axis where R takes that of `joint`, as seen from `body`? Yes where the
/// body's rotation is still open. A quick test, which leaves most joints one counterpart.
bool Correspondence::AxisInPlace(int body, int joint, const Counterpart& counterpart) const {
  if (!R_.settled(body)) return true;
  const int image = body_to_[body];
  const Matrix3d R = R_.Value(body);
  const Vector3d axis = counterpart.sign * b_.joints[counterpart.to].AxisFrom(image);
  if ((R * a_.joints[joint].AxisFrom(body) - axis).norm() > kGeometryTolerance) return false;
  // A slide has a direction and no place.
  if (a_.joints[joint].slide) return true;
  const Vector3d gap = R * a_.FootFrom(body, joint) - b_.FootFrom(image, counterpart.to);
  return gap.norm() <= length_tolerance_;
}

}  // namespace morphbus::congruence
