// What matching one joint with another demands of the rotations of the bodies at its ends.
//
// Each body has its frame in its reference point, parallel to the robot frame at the start values.
// Let d be the axis about which +q moves body Q relative to body P, d' likewise in the image, and
// R_P, R_Q the rotations that take coordinates in P, Q to those in their images. All bodies move
// alike for all q, with q' = s q + o, exactly if
//   R_P d = s d',   R_P and R_Q take the axis' place in P, Q to that in their images,
//   R_Q = Rot(d', -delta) R_P   with   delta = s q_start + o - q'_start,
// where for a slide Rot is the identity and delta the distance that is left along d'. A joint that
// loops lock has one value only, that at the start, so there delta is 0. (docs/congruence.md)
//
// P is `body` below and Q `other`.

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

}  // namespace

/// The offset that maps the joint's limits onto those of its counterpart; 0 if they are the same
/// within their tolerance, or there are none.
double Correspondence::OffsetOfLimits(int joint, const JointImage& counterpart) const {
  const ScrewJoint& from = a_.joints[joint];
  const ScrewJoint& to = b_.joints[counterpart.to];
  if (!from.bounded()) return 0.0;
  // Middle goes to middle: widths are the same (SameRange), so that both limits follow.
  const double middle = counterpart.sign * 0.5 * (from.lower + from.upper);
  const double offset = 0.5 * (to.lower + to.upper) - middle;
  // Limits written 1.5708 and pi/2 are the same limits.
  return std::abs(offset) <= RangeTolerance(from) ? 0.0 : offset;
}

Correspondence::JointPair Correspondence::PairOf(int body, int joint,
                                                 const JointImage& counterpart) const {
  const ScrewJoint& j = a_.joints[joint];
  const ScrewJoint& to = b_.joints[counterpart.to];
  const int image = body_to_[body];
  const int other = j.Other(body);
  const int other_image = to.Other(image);
  // Axes as seen from the body at this end; the image's with the sign of the counterpart beside the
  // one without.
  const Vector3d to_axis = to.AxisFrom(image);
  return {j,
          to,
          joint,
          counterpart,
          body,
          image,
          other,
          other_image,
          j.AxisFrom(body),
          counterpart.sign * to_axis,
          to_axis,
          a_.bodies[other].p_RoTo - a_.bodies[body].p_RoTo,
          b_.bodies[other_image].p_RoTo - b_.bodies[image].p_RoTo};
}

bool Correspondence::Fail(Demand demand, bool beyond, double wanted, double found) {
  failure_->demand = demand;
  failure_->beyond = beyond;
  failure_->wanted = wanted;
  failure_->found = found;
  return false;
}

bool Correspondence::Commit(int body, int joint, const JointImage& counterpart) {
  failure_ = Failure{Demand::kBodies, joint, counterpart};
  joint_to_[joint] = counterpart;
  joint_from_[counterpart.to] = joint;
  joints_order_.push_back(joint);
  const JointPair pair = PairOf(body, joint, counterpart);
  const bool within = pair.other == pair.body;
  if (within != (pair.other_image == pair.image)) return Fail(Demand::kBodies);
  if (!AlignAxis(pair, false)) return false;
  if (within) return CommitWithin(pair);

  // Turning moves no reference point along the axis.
  const double along = pair.apart.dot(pair.d);
  const double along_image = pair.apart_image.dot(pair.d_image);
  if (!pair.joint.slide && std::abs(along - along_image) > length_tolerance_) {
    return Fail(Demand::kAlong, false, along, along_image);
  }
  // The body beyond is placed now or, where a loop has come back to it, has to be in place.
  const bool placed = body_to_[pair.other] >= 0;
  if (placed ? body_to_[pair.other] != pair.other_image : body_from_[pair.other_image] >= 0) {
    return Fail(Demand::kBodies);
  }
  if (placed && !AlignAxis(pair, true)) return false;
  if (pair.joint.slide) return CommitSlide(pair, placed);
  return (placed || PlaceOther(pair)) && CommitAngle(pair);
}

/// How far direction d of `body` is off, at the best turn where that is open (rad).
double Correspondence::AngleOff(int body, const Vector3d& d, const Vector3d& d_image) const {
  const Vector3d now = R_.Value(body) * d;
  if (R_.settled(body)) return AngleBetween(now, d_image);
  const Vector3d axis = R_.GroupAxis(body);
  return std::abs(AngleBetween(now, axis) - AngleBetween(d_image, axis));
}

/// Demands that the pair's body or, if `beyond`, the other one has the axis where its image has it.
bool Correspondence::AlignAxis(const JointPair& pair, bool beyond) {
  const int at = beyond ? pair.other : pair.body;
  if (!R_.AlignDirection(at, pair.d, pair.d_image)) {
    return Fail(Demand::kDirection, beyond, 0.0, AngleOff(at, pair.d, pair.d_image));
  }
  if (pair.joint.slide) return true;
  const Vector3d foot = a_.FootFrom(at, pair.index);
  const Vector3d foot_image = b_.FootFrom(body_to_[at], pair.counterpart.to);
  if (std::abs(foot.norm() - foot_image.norm()) > length_tolerance_) {
    return Fail(Demand::kDistance, beyond, foot.norm(), foot_image.norm());
  }
  if (R_.AlignPosition(at, foot, foot_image)) return true;
  return Fail(Demand::kPlace, beyond, 0.0, (R_.Value(at) * foot - foot_image).norm());
}

bool Correspondence::LockedValueFits(int joint, const JointImage& counterpart) const {
  const ScrewJoint& j = a_.joints[joint];
  const ScrewJoint& to = b_.joints[counterpart.to];
  if (!j.bounded() || !j.locked || !to.locked) return true;
  const double miss = counterpart.sign * j.start + OffsetOfLimits(joint, counterpart) - to.start;
  return std::abs(j.slide ? miss : std::remainder(miss, kTwoPi)) <= RangeTolerance(j);
}

/// Matches a joint with both ends in one body. It cannot move, so which way round it goes is for
/// its value to say: if both are known to be locked, the one value must map onto the other.
bool Correspondence::CommitWithin(const JointPair& pair) {
  const int to = pair.counterpart.to;
  if (LockedValueFits(pair.index, {to, 1.0}) || LockedValueFits(pair.index, {to, -1.0}))
    return true;
  return Fail(Demand::kLocked, false, pair.to.start, pair.joint.start);
}

/// The offset of the joint that the bodies' places say. For one that turns, the rotations at both
/// ends are settled; of offsets a full turn apart it is that next to what the limits ask for.
double Correspondence::OffsetOf(const JointPair& pair) const {
  const double sign = pair.counterpart.sign;
  const double to_start = pair.to.start - sign * pair.joint.start;
  if (pair.joint.slide) {
    return sign * (pair.apart.dot(pair.d) - pair.apart_image.dot(pair.d_image)) + to_start;
  }
  // R_P R_Q^T is Rot(d', delta), and o follows from delta = s q_start + o - q'_start.
  const Matrix3d rest = R_.Value(pair.body) * R_.Value(pair.other).transpose();
  const double offset = AngleAbout(rest, pair.to_axis) + to_start;
  const double near = OffsetOfLimits(pair.index, pair.counterpart);
  return near + std::remainder(offset - near, kTwoPi);
}

/// Demands that the bodies at the ends of a joint that turns are turned to each other as the limits
/// ask, or as the one value of a locked joint does.
bool Correspondence::CommitAngle(const JointPair& pair) {
  // A wheel may be turned about its axis in any way: its offset is free.
  const bool locked = pair.BothLocked();
  if (!pair.joint.bounded() && !locked) return true;
  const double offset = OffsetOfLimits(pair.index, pair.counterpart);
  const double value = pair.counterpart.sign * pair.joint.start + offset;
  const double delta = value - pair.to.start;

  // Two locked joints have one value each, which are mapped onto each other, full turns aside.
  if (locked) {
    if (pair.joint.bounded() && std::abs(std::remainder(delta, kTwoPi)) > kLimitTolerance) {
      return Fail(Demand::kLocked, false, pair.to.start, value);
    }
    if (R_.Relate(pair.body, pair.other, pair.to_axis, 0.0)) return true;
    const Matrix3d rest = R_.Value(pair.other) * R_.Value(pair.body).transpose();
    return Fail(Demand::kLocked, false, pair.to.start,
                pair.to.start + AngleAbout(rest, pair.to_axis));
  }

  // With both ends settled the offset is known, and the limits have to agree.
  if (R_.settled(pair.body) && R_.settled(pair.other)) {
    const double found = OffsetOf(pair);
    return std::abs(found - offset) <= kLimitTolerance ||
           Fail(Demand::kOffset, false, offset, found);
  }

  // Else the limits say how the one end is turned to the other.
  double angle = -delta;
  if (R_.settled(pair.body)) {
    angle += SnapAngle(pair, Turn(pair.to_axis, angle) * R_.Value(pair.body));
  }
  if (R_.Relate(pair.body, pair.other, pair.to_axis, angle)) return true;
  const Matrix3d turned = Turn(pair.to_axis, angle) * R_.Value(pair.body);
  const Matrix3d rest = turned * R_.Value(pair.other).transpose();
  return Fail(Demand::kTurned, false, 0.0, std::abs(AngleAbout(rest, pair.to_axis)));
}

/// Limits hold to kLimitTolerance, places to much less. Where limits alone say that the other body
/// is turned by `wanted`, this is the small turn (rad) about the joint's axis to add, so that one
/// of its next joints lies exactly where one of the image's does.
double Correspondence::SnapAngle(const JointPair& pair, const Matrix3d& wanted) {
  // Every next joint is tried on every one of the image's, as if it were its counterpart; of those
  // that settle the other body the one that asks for the least turn wins. Nothing of the trials
  // stays.
  const PartialRotations::Mark before = R_.mark();
  double best = 0.0;
  double least = kLimitTolerance;
  for (const int next : a_.bodies[pair.other].joints) {
    for (const int to : b_.bodies[pair.other_image].joints) {
      if (next == pair.index || !MayCorrespond(next, to)) continue;
      for (const double sign : {1.0, -1.0}) {
        if (AlignJoint(pair.other, next, {to, sign}) && R_.settled(pair.other)) {
          const Matrix3d rest = R_.Value(pair.other) * wanted.transpose();
          const double angle = AngleAbout(rest, pair.to_axis);
          if (std::abs(angle) <= least) best = angle;
          least = std::min(least, std::abs(angle));
        }
        R_.Undo(before);
      }
    }
  }
  return std::abs(best) < 1e-12 ? 0.0 : best;
}

/// Brings the joint's axis, as seen from `body`, to where that of its counterpart is. False if that
/// is impossible.
bool Correspondence::AlignJoint(int body, int joint, const JointImage& counterpart) {
  const int image = body_to_[body];
  const Vector3d axis = counterpart.sign * b_.joints[counterpart.to].AxisFrom(image);
  return R_.AlignDirection(body, a_.joints[joint].AxisFrom(body), axis) &&
         (a_.joints[joint].slide ||
          R_.AlignPosition(body, a_.FootFrom(body, joint), b_.FootFrom(image, counterpart.to)));
}

/// Places the body at the other end of a joint that turns: wholly, if it reaches out from the axis.
bool Correspondence::PlaceOther(const JointPair& pair) {
  const Vector3d foot = a_.FootFrom(pair.other, pair.index);
  const Vector3d foot_image = b_.FootFrom(pair.other_image, pair.counterpart.to);
  if (std::abs(foot.norm() - foot_image.norm()) > length_tolerance_) {
    return Fail(Demand::kDistance, true, foot.norm(), foot_image.norm());
  }
  MatchBodies(pair.other, pair.other_image);
  if (foot.norm() > length_tolerance_ && foot_image.norm() > length_tolerance_) {
    R_.SetWhole(pair.other, RotationFrom(pair.d, foot, pair.d_image, foot_image));
  } else {
    // Any turn about the axis may follow; to begin with it is as it is with offset 0.
    const double delta = pair.counterpart.sign * pair.joint.start - pair.to.start;
    R_.SetUpToTurn(pair.other, Turn(pair.to_axis, -delta) * R_.Value(pair.body), pair.d_image);
  }
  return true;
}

bool Correspondence::CommitSlide(const JointPair& pair, bool placed) {
  // A slide does not turn, so the rotation is the same at both ends.
  if (!placed) {
    MatchBodies(pair.other, pair.other_image);
    R_.SetLike(pair.other, pair.body);
  } else if (!R_.Relate(pair.body, pair.other, pair.d_image, 0.0)) {
    const Matrix3d rest = R_.Value(pair.body) * R_.Value(pair.other).transpose();
    return Fail(Demand::kTurned, false, 0.0, std::abs(AngleAbout(rest, pair.d_image)));
  }

  // Across the slide the reference points keep their distance and direction.
  const Vector3d across = pair.apart - pair.apart.dot(pair.d) * pair.d;
  const Vector3d across_image =
      pair.apart_image - pair.apart_image.dot(pair.d_image) * pair.d_image;
  if (std::abs(across.norm() - across_image.norm()) > length_tolerance_) {
    return Fail(Demand::kApart, false, across.norm(), across_image.norm());
  }
  if (!R_.AlignPosition(pair.body, across, across_image)) {
    return Fail(Demand::kAcross, false, 0.0, (R_.Value(pair.body) * across - across_image).norm());
  }

  // Along it their distance says the offset, with which the limits or the one value have to agree.
  const double found = OffsetOf(pair);
  const double value = pair.counterpart.sign * pair.joint.start + found;
  if (pair.BothLocked() && std::abs(value - pair.to.start) > length_tolerance_) {
    return Fail(Demand::kLocked, false, pair.to.start, value);
  }
  if (!pair.joint.bounded()) return true;
  const double offset = OffsetOfLimits(pair.index, pair.counterpart);
  return std::abs(found - offset) <= slide_tolerance_ ||
         Fail(Demand::kOffset, false, offset, found);
}

}  // namespace morphbus::congruence
