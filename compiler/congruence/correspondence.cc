#include "compiler/congruence/correspondence.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

namespace morphbus::congruence {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Correspondence::Correspondence(const Assembly& a, const Assembly& b, Classes classes)
    : a_(a),
      b_(b),
      classes_(std::move(classes)),
      length_tolerance_(kGeometryTolerance * std::max(a.extent_m, b.extent_m)),
      slide_tolerance_(SlideTolerance(a, b)),
      R_(a.bodies.size(), {length_tolerance_, kGeometryTolerance}),
      body_to_(a.bodies.size(), -1),
      body_from_(b.bodies.size(), -1),
      joint_to_(a.joints.size(), Option{-1, 1.0}),
      joint_from_(b.joints.size(), -1) {}

void Correspondence::Undo(const Mark& mark) {
  for (; joints_order_.size() > mark.joints; joints_order_.pop_back()) {
    Option& option = joint_to_[joints_order_.back()];
    joint_from_[option.to] = -1;
    option.to = -1;
  }
  for (; order_.size() > mark.bodies; order_.pop_back()) {
    const int body = order_.back();
    body_from_[body_to_[body]] = -1;
    body_to_[body] = -1;
    R_.Forget(body);
  }
  R_.Undo(mark.rotations);
}

void Correspondence::MatchBodies(int body, int image) {
  body_to_[body] = image;
  body_from_[image] = body;
  order_.push_back(body);
}

void Correspondence::PlaceSeed(int seed, int image, int joint, const Option& option) {
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

bool Correspondence::MayCorrespond(int joint, int to) const {
  return classes_.joints[0][joint] == classes_.joints[1][to] &&
         SameRange(a_.joints[joint], b_.joints[to], slide_tolerance_);
}

std::vector<Option> Correspondence::OptionsFor(int body, int joint) const {
  std::vector<Option> options;
  for (const int to : b_.bodies[body_to_[body]].joints) AddOptions(body, joint, to, options);
  return options;
}

void Correspondence::AddOptions(int body, int joint, int to, std::vector<Option>& options) const {
  if (joint_from_[to] >= 0 || !MayCorrespond(joint, to)) return;
  const int image = body_to_[body];
  const int other = a_.joints[joint].Other(body);
  const int other_image = b_.joints[to].Other(image);
  if ((other == body) != (other_image == image)) return;
  if (body_to_[other] >= 0 ? body_to_[other] != other_image : body_from_[other_image] >= 0) return;
  if (classes_.bodies[0][other] != classes_.bodies[1][other_image]) return;
  for (const double sign : {1.0, -1.0}) {
    if (Plausible(body, joint, {to, sign})) options.push_back({to, sign});
  }
}

/// Quick, so that most joints have one option.
bool Correspondence::Plausible(int body, int joint, const Option& option) const {
  if (!R_.settled(body)) return true;
  const int image = body_to_[body];
  const Matrix3d R = R_.Value(body);
  const Vector3d axis = option.sign * b_.joints[option.to].AxisFrom(image);
  if ((R * a_.joints[joint].AxisFrom(body) - axis).norm() > kGeometryTolerance) return false;
  if (a_.joints[joint].slide) return true;
  const Vector3d gap = R * a_.FootFrom(body, joint) - b_.FootFrom(image, option.to);
  return gap.norm() <= length_tolerance_;
}

}  // namespace morphbus::congruence
