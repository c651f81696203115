// What matching one joint with another demands of the rotations of the bodies at its ends.
//
// Body T has its frame in its reference point, parallel to the robot frame at the start values. Let
// d be the axis about which +q moves body Q relative to T, d' likewise in the image, and R_T, R_Q
// the rotations that take coordinates in T, Q to those in their images. All bodies move alike for
// all q, with q' = s q + o, exactly if
//   R_T d = s d',   R_T and R_Q take the axis' place in T, Q to that in their images,
//   R_Q = Rot(d', -delta) R_T   with   delta = s q_start + o - q'_start,
// where for a slide Rot is the identity and delta the distance that is left along d'. A joint that
// loops lock has one value only, that at the start, so there delta is 0.

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "compiler/congruence/correspondence.h"

namespace morphbus::congruence {

using Demand = Failure::Demand;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

/// Angle between two unit vectors.
double AngleBetween(const Vector3d& x, const Vector3d& y) {
  return std::atan2(x.cross(y).norm(), x.dot(y));
}

bool BothLocked(const AssemblyJoint& joint, const AssemblyJoint& to) {
  return joint.locked && to.locked;
}

}  // namespace

double OffsetOfLimits(const AssemblyJoint& joint, const AssemblyJoint& to, double sign,
                      double slide_tolerance) {
  const double low = sign > 0.0 ? to.lower - joint.lower : to.lower + joint.upper;
  const double high = sign > 0.0 ? to.upper - joint.upper : to.upper + joint.lower;
  const double offset = 0.5 * (low + high);
  // Limits written 1.5708 and pi/2 are the same limits.
  return std::abs(offset) <= (joint.slide ? slide_tolerance : kLimitTolerance) ? 0.0 : offset;
}

bool SameRange(const AssemblyJoint& joint, const AssemblyJoint& to, double slide_tolerance) {
  if (joint.slide != to.slide || joint.bounded() != to.bounded()) return false;
  if (!joint.bounded()) return true;
  const double difference = (joint.upper - joint.lower) - (to.upper - to.lower);
  return std::abs(difference) <= (joint.slide ? slide_tolerance : kLimitTolerance);
}

bool Correspondence::Fail(Demand demand, bool beyond, double wanted, double found) {
  failure_->demand = demand;
  failure_->beyond = beyond;
  failure_->wanted = wanted;
  failure_->found = found;
  return false;
}

bool Correspondence::Commit(int body, int joint, const Option& option) {
  failure_ = Failure{Demand::kBodies, joint, option};
  joint_to_[joint] = option;
  joint_from_[option.to] = joint;
  joints_order_.push_back(joint);
  const AssemblyJoint& j = a_.joints[joint];
  const AssemblyJoint& to = b_.joints[option.to];
  const bool still = j.Other(body) == body;
  if (still != (to.Other(body_to_[body]) == body_to_[body])) return Fail(Demand::kBodies);
  if (still) return CommitStill(body, joint, option);
  return j.slide ? CommitSlide(body, joint, option) : CommitTurn(body, joint, option);
}

/// How far direction d of `body` is off, at the best turn where that is open.
double Correspondence::AngleOff(int body, const Vector3d& d, const Vector3d& d_image) const {
  const Vector3d now = R_.Value(body) * d;
  if (R_.settled(body)) return AngleBetween(now, d_image);
  const Vector3d axis = R_.GroupAxis(body);
  return std::abs(AngleBetween(now, axis) - AngleBetween(d_image, axis));
}

/// Demands that `body` or, if `beyond`, the other one has the axis where its image has it.
bool Correspondence::AlignAxis(int body, int joint, const Option& option, bool beyond) {
  const AssemblyJoint& j = a_.joints[joint];
  const AssemblyJoint& to = b_.joints[option.to];
  const Vector3d d = j.AxisFrom(body);
  const Vector3d d_image = option.sign * to.AxisFrom(body_to_[body]);
  const int at = beyond ? j.Other(body) : body;
  if (!R_.AlignDirection(at, d, d_image)) {
    return Fail(Demand::kDirection, beyond, 0.0, AngleOff(at, d, d_image));
  }
  if (j.slide) return true;
  const Vector3d foot = a_.FootFrom(at, joint);
  const Vector3d foot_image = b_.FootFrom(body_to_[at], option.to);
  if (std::abs(foot.norm() - foot_image.norm()) > length_tolerance_) {
    return Fail(Demand::kDistance, beyond, foot.norm(), foot_image.norm());
  }
  if (R_.AlignPosition(at, foot, foot_image)) return true;
  return Fail(Demand::kPlace, beyond, 0.0, (R_.Value(at) * foot - foot_image).norm());
}

bool Correspondence::StillFits(int joint, const Option& option) const {
  const AssemblyJoint& j = a_.joints[joint];
  const AssemblyJoint& to = b_.joints[option.to];
  if (!j.bounded() || !BothLocked(j, to)) return true;
  const double offset = OffsetOfLimits(j, to, option.sign, slide_tolerance_);
  const double miss = option.sign * j.start + offset - to.start;
  return j.slide ? std::abs(miss) <= slide_tolerance_
                 : std::abs(std::remainder(miss, kTwoPi)) <= kLimitTolerance;
}

/// Both ends in one body: it cannot move, so which way round it goes is for its value to say.
bool Correspondence::CommitStill(int body, int joint, const Option& option) {
  if (!AlignAxis(body, joint, option, false)) return false;
  if (StillFits(joint, {option.to, 1.0}) || StillFits(joint, {option.to, -1.0})) return true;
  return Fail(Demand::kLocked, false, b_.joints[option.to].start, a_.joints[joint].start);
}

bool Correspondence::CommitTurn(int body, int joint, const Option& option) {
  const AssemblyJoint& j = a_.joints[joint];
  const AssemblyJoint& to = b_.joints[option.to];
  const int image = body_to_[body];
  const int other = j.Other(body);
  const int other_image = to.Other(image);
  if (!AlignAxis(body, joint, option, false)) return false;
  const Vector3d d = j.AxisFrom(body);
  const Vector3d d_image = option.sign * to.AxisFrom(image);
  const double along = (a_.bodies[other].p_RoTo - a_.bodies[body].p_RoTo).dot(d);
  const double along_image = (b_.bodies[other_image].p_RoTo - b_.bodies[image].p_RoTo).dot(d_image);
  if (std::abs(along - along_image) > length_tolerance_) {
    return Fail(Demand::kAlong, false, along, along_image);
  }
  if (body_to_[other] < 0) {
    if (body_from_[other_image] >= 0) return Fail(Demand::kBodies);
    if (!PlaceOther(body, joint, option)) return false;
  } else {
    if (body_to_[other] != other_image) return Fail(Demand::kBodies);
    if (!AlignAxis(body, joint, option, true)) return false;
  }
  return CommitAngle(body, joint, option);
}

/// The offset that the rotations at both ends, which are settled, leave to a joint that turns; of
/// those a full turn apart the one next to what its limits ask for.
double Correspondence::OffsetOf(int joint, const Option& option) const {
  const AssemblyJoint& j = a_.joints[joint];
  const AssemblyJoint& to = b_.joints[option.to];
  const Vector3d d_to = to.AxisFrom(body_to_[j.body_b]);
  const double delta = AngleAbout(R_.Value(j.body_b) * R_.Value(j.body_a).transpose(), d_to);
  const double offset = delta + to.start - option.sign * j.start;
  const double near = j.bounded() ? OffsetOfLimits(j, to, option.sign, slide_tolerance_) : 0.0;
  return near + std::remainder(offset - near, kTwoPi);
}

/// Demands that the bodies at the ends of a joint that turns are turned to each other as the limits
/// ask, or as the one value of a locked joint does.
bool Correspondence::CommitAngle(int body, int joint, const Option& option) {
  const AssemblyJoint& j = a_.joints[joint];
  const AssemblyJoint& to = b_.joints[option.to];
  const int other = j.Other(body);
  const Vector3d axis = to.AxisFrom(body_to_[body]);
  const bool locked = BothLocked(j, to);
  if (!j.bounded() && !locked) return true;
  const double offset = j.bounded() ? OffsetOfLimits(j, to, option.sign, slide_tolerance_) : 0.0;
  const double delta = option.sign * j.start + offset - to.start;
  if (locked) {
    if (j.bounded() && std::abs(std::remainder(delta, kTwoPi)) > kLimitTolerance) {
      return Fail(Demand::kLocked, false, to.start, option.sign * j.start + offset);
    }
    if (R_.Relate(body, other, axis, 0.0)) return true;
    const Matrix3d rest = R_.Value(other) * R_.Value(body).transpose();
    return Fail(Demand::kLocked, false, to.start, to.start + AngleAbout(rest, axis));
  }
  if (R_.settled(body) && R_.settled(other)) {
    const double found = OffsetOf(joint, option);
    return std::abs(found - offset) <= kLimitTolerance ||
           Fail(Demand::kOffset, false, offset, found);
  }
  double angle = -delta;
  if (R_.settled(body)) angle += SnapAngle(other, joint, Turn(axis, angle) * R_.Value(body), axis);
  if (R_.Relate(body, other, axis, angle)) return true;
  const Matrix3d rest = Turn(axis, angle) * R_.Value(body) * R_.Value(other).transpose();
  return Fail(Demand::kTurned, false, 0.0, std::abs(AngleAbout(rest, axis)));
}

/// Limits hold to kLimitTolerance, places to less: where limits alone say how far `body` turns
/// about `axis_image`, the small turn after `R` that brings its next joint to that of its image.
double Correspondence::SnapAngle(int body, int joint, const Matrix3d& R,
                                 const Vector3d& axis_image) const {
  double best = 0.0;
  double least = kLimitTolerance;
  const auto try_vectors = [&](const Vector3d& u, const Vector3d& u_image) {
    const Vector3d from = R * u - (R * u).dot(axis_image) * axis_image;
    const Vector3d to = u_image - u_image.dot(axis_image) * axis_image;
    const double angle = std::atan2(from.cross(to).dot(axis_image), from.dot(to));
    if (std::abs(angle) > least) return;
    least = std::abs(angle);
    best = angle;
  };
  const Vector3d d = R.transpose() * axis_image;
  for (const int next : a_.bodies[body].joints) {
    if (next == joint) continue;
    const Vector3d axis = a_.joints[next].AxisFrom(body);
    const Vector3d foot = a_.FootFrom(body, next);
    const bool tilted = axis.cross(d).norm() > kGeometryTolerance;
    const bool apart = !a_.joints[next].slide && foot.cross(d).norm() > length_tolerance_;
    if (!tilted && !apart) continue;
    for (const int to : b_.bodies[body_to_[body]].joints) {
      if (!MayCorrespond(next, to)) continue;
      const Vector3d axis_to = b_.joints[to].AxisFrom(body_to_[body]);
      if (tilted) {
        try_vectors(axis, axis_to);
        try_vectors(axis, -axis_to);
      } else {
        try_vectors(foot, b_.FootFrom(body_to_[body], to));
      }
    }
    break;
  }
  return std::abs(best) < 1e-12 ? 0.0 : best;
}

/// Places the body at the other end of a joint that turns: wholly, if it reaches out from the axis.
bool Correspondence::PlaceOther(int body, int joint, const Option& option) {
  const AssemblyJoint& j = a_.joints[joint];
  const AssemblyJoint& to = b_.joints[option.to];
  const int image = body_to_[body];
  const int other = j.Other(body);
  const int other_image = to.Other(image);
  const Vector3d d = j.AxisFrom(body);
  const Vector3d d_image = option.sign * to.AxisFrom(image);
  const Vector3d foot = a_.FootFrom(other, joint);
  const Vector3d foot_image = b_.FootFrom(other_image, option.to);
  if (std::abs(foot.norm() - foot_image.norm()) > length_tolerance_) {
    return Fail(Demand::kDistance, true, foot.norm(), foot_image.norm());
  }
  MatchBodies(other, other_image);
  if (foot.norm() > length_tolerance_ && foot_image.norm() > length_tolerance_) {
    R_.SetWhole(other, RotationFrom(d, foot, d_image, foot_image));
  } else {
    // As it is with offset 0.
    const double delta = option.sign * j.start - to.start;
    R_.SetUpToTurn(other, Turn(to.AxisFrom(image), -delta) * R_.Value(body), d_image);
  }
  return true;
}

bool Correspondence::CommitSlide(int body, int joint, const Option& option) {
  const AssemblyJoint& j = a_.joints[joint];
  const AssemblyJoint& to = b_.joints[option.to];
  const int image = body_to_[body];
  const int other = j.Other(body);
  const int other_image = to.Other(image);
  const Vector3d d = j.AxisFrom(body);
  const Vector3d d_image = option.sign * to.AxisFrom(image);
  if (!AlignAxis(body, joint, option, false)) return false;
  if (body_to_[other] < 0) {
    if (body_from_[other_image] >= 0) return Fail(Demand::kBodies);
    MatchBodies(other, other_image);
    R_.SetLike(other, body);
  } else {
    if (body_to_[other] != other_image) return Fail(Demand::kBodies);
    if (!AlignAxis(body, joint, option, true)) return false;
    if (!R_.Relate(body, other, d_image, 0.0)) {
      const Matrix3d rest = R_.Value(body) * R_.Value(other).transpose();
      return Fail(Demand::kTurned, false, 0.0, std::abs(AngleAbout(rest, d_image)));
    }
  }
  const Vector3d apart = a_.bodies[other].p_RoTo - a_.bodies[body].p_RoTo;
  const Vector3d apart_image = b_.bodies[other_image].p_RoTo - b_.bodies[image].p_RoTo;
  const double along = apart.dot(d);
  const double along_image = apart_image.dot(d_image);
  const Vector3d across = apart - along * d;
  const Vector3d across_image = apart_image - along_image * d_image;
  if (std::abs(across.norm() - across_image.norm()) > length_tolerance_) {
    return Fail(Demand::kApart, false, across.norm(), across_image.norm());
  }
  if (!R_.AlignPosition(body, across, across_image)) {
    return Fail(Demand::kAcross, false, 0.0, (R_.Value(body) * across - across_image).norm());
  }
  const double delta = option.sign * (along - along_image);
  if (BothLocked(j, to) && std::abs(delta) > length_tolerance_) {
    return Fail(Demand::kLocked, false, to.start, to.start + delta);
  }
  if (!j.bounded()) return true;
  const double offset = OffsetOfLimits(j, to, option.sign, slide_tolerance_);
  const double found = delta + to.start - option.sign * j.start;
  return std::abs(found - offset) <= slide_tolerance_ ||
         Fail(Demand::kOffset, false, offset, found);
}

}  // namespace morphbus::congruence
