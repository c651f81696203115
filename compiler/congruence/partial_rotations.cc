#include "compiler/congruence/partial_rotations.h"

#include <Eigen/Geometry>
#include <cmath>

namespace morphbus::congruence {

using Eigen::Matrix3d;
using Eigen::Vector3d;

double AngleAbout(const Matrix3d& R, const Vector3d& axis) {
  // The skew part of a rotation by t about n is sin(t) [n], its trace 1 + 2 cos(t).
  const Vector3d twice_sine(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
  return std::atan2(twice_sine.dot(axis), R.trace() - 1.0);
}

Matrix3d Turn(const Vector3d& axis, double angle) {
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

Matrix3d RotationFrom(const Vector3d& d, const Vector3d& u, const Vector3d& d_image,
                      const Vector3d& u_image) {
  // The orthonormal frame with x along the first vector and y towards the second.
  const auto frame = [](const Vector3d& x, const Vector3d& near_y) {
    Matrix3d F;
    F.col(0) = x;
    F.col(2) = x.cross(near_y).normalized();
    F.col(1) = F.col(2).cross(x);
    return F;
  };
  return frame(d_image, u_image) * frame(d, u).transpose();
}

namespace {

/// A rotation that takes the unit vector `from` to the unit vector `to`; a turn about `to` is free.
/// Eigen's Quaternion::FromTwoVectors would do, but decomposes a matrix for opposite vectors, whose
/// templates take longer to compile than all else in this file.
Matrix3d RotationOnto(const Vector3d& from, const Vector3d& to) {
  const double cosine = from.dot(to);
  // Beyond a right angle a half turn about a normal comes first, which is exact for opposite
  // vectors: about z as nearly as may be, so that modules are turned over about their own axes.
  if (cosine < 0.0) {
    const Vector3d z = std::abs(from.z()) < 0.9 ? Vector3d::UnitZ() : Vector3d::UnitX();
    const Vector3d normal = (z - z.dot(from) * from).normalized();
    return RotationOnto(-from, to) * (2.0 * normal * normal.transpose() - Matrix3d::Identity());
  }
  // The half-angle form: scalar part 1 + cos t and vector part n sin t, normalized.
  const Vector3d sine = from.cross(to);
  return Eigen::Quaterniond(1.0 + cosine, sine.x(), sine.y(), sine.z())
      .normalized()
      .toRotationMatrix();
}

}  // namespace

PartialRotations::Found PartialRotations::Find(int group) const {
  Found found{group, 1.0, 0.0};
  while (groups_[found.root].parent >= 0) {
    const Group& at = groups_[found.root];
    found.constant += found.sign * at.constant;
    found.sign *= at.sign;
    found.root = at.parent;
  }
  return found;
}

int PartialRotations::freedom(int body) const {
  const int group = bodies_[body].group;
  if (group < 0) return group == kWhole ? 0 : 3;
  return groups_[Find(group).root].settled ? 0 : 1;
}

Matrix3d PartialRotations::Value(int body) const {
  const BodyEntry& entry = bodies_[body];
  if (entry.group < 0) return entry.R;
  // The group's own angle follows from its root's, which is taken as 0 where it is open.
  const Found found = Find(entry.group);
  const Group& root = groups_[found.root];
  const double angle = found.constant + (root.settled ? found.sign * root.constant : 0.0);
  if (angle == 0.0) return entry.R;
  return Turn(groups_[entry.group].axis_image, angle) * entry.R;
}

Vector3d PartialRotations::GroupAxis(int body) const {
  const int group = bodies_[body].group;
  return Find(group).sign * groups_[group].axis_image;
}

void PartialRotations::Set(int body, const BodyEntry& entry) {
  body_trail_.emplace_back(body, bodies_[body]);
  bodies_[body] = entry;
}

void PartialRotations::SetWhole(int body, const Matrix3d& R) { Set(body, {kWhole, R}); }

void PartialRotations::SetUpToTurn(int body, const Matrix3d& R, const Vector3d& axis_image) {
  Set(body, {static_cast<int>(groups_.size()), R});
  groups_.emplace_back().axis_image = axis_image;
}

/// The group, to be changed, after what it was is kept for Undo.
PartialRotations::Group& PartialRotations::Change(int group) {
  group_trail_.emplace_back(group, groups_[group]);
  return groups_[group];
}

/// Turns the open `body` by `angle` from where Value has it, and settles its group so. Value has an
/// open root at angle 0, so the angle of the root is what is added, as the body sees it.
void PartialRotations::Settle(int body, double angle) {
  const Found found = Find(bodies_[body].group);
  Group& root = Change(found.root);
  root.settled = true;
  root.constant = found.sign * angle;
}

bool PartialRotations::AlignVector(int body, const Vector3d& u, const Vector3d& image,
                                   double tolerance) {
  const Vector3d now = Value(body) * u;
  if (settled(body)) return (now - image).norm() <= tolerance;

  // The first vector that says anything leaves a turn about itself open.
  if (bodies_[body].group == kUnknown) {
    if (std::abs(u.norm() - image.norm()) > tolerance) return false;
    if (u.norm() <= tolerance) return true;
    const Vector3d axis = image.normalized();
    SetUpToTurn(body, RotationOnto(u.normalized(), axis), axis);
    return true;
  }

  // A turn about the axis keeps the part along it, and the length of the part across.
  const Vector3d& axis = groups_[bodies_[body].group].axis_image;
  if (std::abs((now - image).dot(axis)) > tolerance) return false;
  const Vector3d from = now - now.dot(axis) * axis;
  const Vector3d to = image - image.dot(axis) * axis;
  if (std::abs(from.norm() - to.norm()) > tolerance) return false;

  // A vector along the axis says nothing of the turn; any other determines it.
  if (from.norm() <= tolerance) return true;
  Settle(body, std::atan2(from.cross(to).dot(axis), from.dot(to)));
  return true;
}

bool PartialRotations::AlignWhole(int body, const Matrix3d& wanted) {
  // What is missing must be a turn about the axis that is open.
  const Matrix3d rest = wanted * Value(body).transpose();
  if (settled(body)) return (rest - Matrix3d::Identity()).norm() <= 2.0 * tolerance_.angle;
  const Vector3d& axis = groups_[bodies_[body].group].axis_image;
  if ((rest * axis - axis).norm() > tolerance_.angle) return false;
  Settle(body, AngleAbout(rest, axis));
  return true;
}

bool PartialRotations::Relate(int body_t, int body_q, const Vector3d& axis, double angle) {
  const Matrix3d turn = Turn(axis, angle);
  if (settled(body_t)) return AlignWhole(body_q, turn * Value(body_t));
  if (settled(body_q)) return AlignWhole(body_t, turn.transpose() * Value(body_q));

  // Both are open, so both turn about this axis: their angles differ by what is missing.
  const int group_q = bodies_[body_q].group;
  const Vector3d& axis_q = groups_[group_q].axis_image;
  const double sense = axis_q.dot(groups_[bodies_[body_t].group].axis_image) > 0.0 ? 1.0 : -1.0;
  const Matrix3d rest = turn * Value(body_t) * Value(body_q).transpose();
  if ((rest * axis_q - axis_q).norm() > tolerance_.angle) return false;
  const double missing = AngleAbout(rest, axis_q);
  const Found t = Find(bodies_[body_t].group);
  const Found q = Find(group_q);

  // Where t's body turns by x, q's has to turn by sense * x. In terms of the roots' angles x is
  // t.sign * (root of t) and sense * x is q.sign * (root of q); in one group these must agree.
  if (t.root == q.root) {
    return std::abs(missing) <= 2.0 * tolerance_.angle && t.sign * sense == q.sign;
  }

  // Of two groups q's root becomes a child of t's.
  Group& root = Change(q.root);
  root.parent = t.root;
  root.sign = q.sign * sense * t.sign;
  root.constant = q.sign * missing;
  return true;
}

void PartialRotations::Undo(const Mark& mark) {
  for (; group_trail_.size() > mark.changes; group_trail_.pop_back()) {
    groups_[group_trail_.back().first] = group_trail_.back().second;
  }
  for (; body_trail_.size() > mark.bodies; body_trail_.pop_back()) {
    bodies_[body_trail_.back().first] = body_trail_.back().second;
  }
  groups_.resize(mark.groups);
}

}  // namespace morphbus::congruence
