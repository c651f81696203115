// What matching one joint with another demands of the rotations of the bodies at its ends.
//
// Body T has its frame in its reference point, parallel to the robot frame at the start values. Let
// d be the axis about which +q moves body Q relative to T, d' likewise in the image, and R_T, R_Q
// the rotations that take coordinates in T, Q to those in their images. All bodies move alike for
// all q, with q' = s q + o, exactly if
//   R_T d = s d',   R_T and R_Q take the axis' place in T, Q to that in their images,
//   R_Q = Rot(d', -delta) R_T   with   delta = s q_start + o - q'_start,
// where for a slide Rot is the identity and delta the distance that is left along d'.

#include <Eigen/Geometry>
#include <cmath>

#include "compiler/congruence/search.h"

namespace morphbus::congruence {

using Eigen::Matrix3d;
using Eigen::Vector3d;

double OffsetOfLimits(const AssemblyJoint& joint, const AssemblyJoint& to, double sign) {
  const double low = sign > 0.0 ? to.lower - joint.lower : to.lower + joint.upper;
  const double high = sign > 0.0 ? to.upper - joint.upper : to.upper + joint.lower;
  const double offset = 0.5 * (low + high);
  // Limits written 1.5708 and pi/2 are the same limits.
  const double small = kLimitTolerance * (joint.slide ? std::abs(joint.upper - joint.lower) : 1.0);
  return std::abs(offset) <= small ? 0.0 : offset;
}

bool SameRange(const AssemblyJoint& joint, const AssemblyJoint& to, double slide_tolerance) {
  if (joint.slide != to.slide || joint.bounded() != to.bounded()) return false;
  if (!joint.bounded()) return true;
  const double difference = (joint.upper - joint.lower) - (to.upper - to.lower);
  return std::abs(difference) <= (joint.slide ? slide_tolerance : kLimitTolerance);
}

void Search::MatchBodies(int body, int image) {
  body_to_[body] = image;
  body_from_[image] = body;
  order_.push_back(body);
}

/// Places the seed as `joint`'s axis tells, which is all that is known.
void Search::PlaceSeed(int seed, int image, int joint, const Option& option) {
  MatchBodies(seed, image);
  if (joint < 0) return R_.SetWhole(seed, Matrix3d::Identity());  // a body alone: any rotation
  const Vector3d d = a_.joints[joint].AxisFrom(seed);
  const Vector3d d_image = option.sign * b_.joints[option.to].AxisFrom(image);
  const Vector3d foot = a_.FootFrom(seed, joint);
  const Vector3d foot_image = b_.FootFrom(image, option.to);
  const bool apart = foot.norm() > length_tolerance_ && foot_image.norm() > length_tolerance_;
  if (!a_.joints[joint].slide && apart) {
    return R_.SetWhole(seed, RotationFrom(d, foot, d_image, foot_image));
  }
  const Matrix3d R = Eigen::Quaterniond::FromTwoVectors(d, d_image).toRotationMatrix();
  R_.SetUpToTurn(seed, R, d_image);
}

bool Search::Commit(int body, int joint, const Option& option) {
  joint_to_[joint] = option;
  joint_from_[option.to] = joint;
  joints_order_.push_back(joint);
  return a_.joints[joint].slide ? CommitSlide(body, joint, option)
                                : CommitTurn(body, joint, option);
}

bool Search::CommitTurn(int body, int joint, const Option& option) {
  const AssemblyJoint& j = a_.joints[joint];
  const AssemblyJoint& to = b_.joints[option.to];
  const int image = body_to_[body];
  const int other = j.Other(body);
  const int other_image = to.Other(image);
  if ((other == body) != (other_image == image)) return false;
  const Vector3d d = j.AxisFrom(body);
  const Vector3d d_image = option.sign * to.AxisFrom(image);
  if (!R_.AlignDirection(body, d, d_image)) return false;
  if (!R_.AlignPosition(body, a_.FootFrom(body, joint), b_.FootFrom(image, option.to))) {
    return false;
  }
  if (other == body) return true;  // both ends in one body: it cannot move
  const double along = (a_.bodies[other].p_RoTo - a_.bodies[body].p_RoTo).dot(d);
  const double along_image = (b_.bodies[other_image].p_RoTo - b_.bodies[image].p_RoTo).dot(d_image);
  if (std::abs(along - along_image) > length_tolerance_) return false;
  if (body_to_[other] < 0) {
    if (body_from_[other_image] >= 0 || !PlaceOther(body, joint, option)) return false;
  } else {
    if (body_to_[other] != other_image || !R_.AlignDirection(other, d, d_image) ||
        !R_.AlignPosition(other, a_.FootFrom(other, joint), b_.FootFrom(other_image, option.to))) {
      return false;
    }
  }
  if (!j.bounded()) return true;
  const double delta = option.sign * j.start + OffsetOfLimits(j, to, option.sign) - to.start;
  return R_.Relate(body, other, to.AxisFrom(image), -delta);
}

/// Places the body at the other end of a joint that turns: wholly, if it reaches out from the axis.
bool Search::PlaceOther(int body, int joint, const Option& option) {
  const AssemblyJoint& j = a_.joints[joint];
  const AssemblyJoint& to = b_.joints[option.to];
  const int image = body_to_[body];
  const int other = j.Other(body);
  const int other_image = to.Other(image);
  const Vector3d d = j.AxisFrom(body);
  const Vector3d d_image = option.sign * to.AxisFrom(image);
  const Vector3d foot = a_.FootFrom(other, joint);
  const Vector3d foot_image = b_.FootFrom(other_image, option.to);
  if (std::abs(foot.norm() - foot_image.norm()) > length_tolerance_) return false;
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

bool Search::CommitSlide(int body, int joint, const Option& option) {
  const AssemblyJoint& j = a_.joints[joint];
  const AssemblyJoint& to = b_.joints[option.to];
  const int image = body_to_[body];
  const int other = j.Other(body);
  const int other_image = to.Other(image);
  if ((other == body) != (other_image == image)) return false;
  const Vector3d d = j.AxisFrom(body);
  const Vector3d d_image = option.sign * to.AxisFrom(image);
  if (!R_.AlignDirection(body, d, d_image)) return false;
  if (other == body) return true;
  if (body_to_[other] < 0) {
    if (body_from_[other_image] >= 0) return false;
    MatchBodies(other, other_image);
    R_.SetLike(other, body);
  } else if (body_to_[other] != other_image || !R_.AlignDirection(other, d, d_image) ||
             !R_.Relate(body, other, d_image, 0.0)) {
    return false;
  }
  const Vector3d apart = a_.bodies[other].p_RoTo - a_.bodies[body].p_RoTo;
  const Vector3d apart_image = b_.bodies[other_image].p_RoTo - b_.bodies[image].p_RoTo;
  const double along = apart.dot(d);
  const double along_image = apart_image.dot(d_image);
  if (!R_.AlignPosition(body, apart - along * d, apart_image - along_image * d_image)) {
    return false;
  }
  if (!j.bounded()) return true;
  const double delta = option.sign * (along - along_image);
  const double wanted = option.sign * j.start + OffsetOfLimits(j, to, option.sign) - to.start;
  return std::abs(delta - wanted) <= slide_tolerance_;
}

}  // namespace morphbus::congruence
