#include "compiler/congruence/explain.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

namespace morphbus::congruence {
namespace {

using Eigen::Vector3d;

constexpr double kDegrees = 180.0 / std::numbers::pi;

std::string Counted(size_t count, const std::string& one, const std::string& many) {
  return fmt::format("{} {}", count == 0 ? "no" : std::to_string(count), count == 1 ? one : many);
}

/// -0 as 0, no tails of rounding.
double Plain(double v) { return std::abs(v) < 5e-7 ? 0.0 : v; }

std::string Text(const Vector3d& v) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g})", Plain(v.x()), Plain(v.y()), Plain(v.z()));
}

std::string RangeText(const AssemblyJoint& j) {
  if (!j.bounded()) return j.slide ? "slides without limits" : "turns without limits";
  if (j.slide) return fmt::format("slides from {:.6g} to {:.6g} m", Plain(j.lower), Plain(j.upper));
  return fmt::format("turns from {:.6g} to {:.6g} degrees", Plain(j.lower * kDegrees),
                     Plain(j.upper * kDegrees));
}

/// The class whose members differ in number, the rarest first; -1 as member where one has none.
struct CountDifference {
  size_t count[2] = {0, 0};
  int member[2] = {-1, -1};
};

std::optional<CountDifference> RarestDifference(const std::vector<uint64_t> (&classes)[2]) {
  std::map<uint64_t, CountDifference> members;
  for (const int side : {0, 1}) {
    for (size_t i = 0; i < classes[side].size(); ++i) {
      CountDifference& entry = members[classes[side][i]];
      if (entry.count[side]++ == 0) entry.member[side] = static_cast<int>(i);
    }
  }
  std::optional<CountDifference> rarest;
  const auto size = [](const CountDifference& d) { return d.count[0] + d.count[1]; };
  for (const auto& [name, entry] : members) {
    if (entry.count[0] == entry.count[1]) continue;
    if (!rarest || size(entry) < size(*rarest)) rarest = entry;
  }
  return rarest;
}

/// How far joint `to` of b is from where `stuck.joint` would have its counterpart.
struct Miss {
  int joint = -1;
  double angle = 0.0;  ///< rad
  double metres = 0.0;
};

Miss NearestJoint(const Assembly& a, const Assembly& b, const Stuck& stuck) {
  const AssemblyJoint& j = a.joints[stuck.joint];
  const Vector3d axis = stuck.R * j.AxisFrom(stuck.body);
  const Vector3d foot = stuck.R * a.FootFrom(stuck.body, stuck.joint);
  Miss best;
  double least = std::numeric_limits<double>::infinity();
  for (const int to : b.bodies[stuck.image].joints) {
    if (stuck.taken[to] || b.joints[to].slide != j.slide) continue;
    const double sine = axis.cross(b.joints[to].axis).norm();
    const double angle = std::atan2(sine, std::abs(axis.dot(b.joints[to].axis)));
    const double metres = j.slide ? 0.0 : (foot - b.FootFrom(stuck.image, to)).norm();
    const double miss = angle + metres / std::max(b.extent_m, 1e-12);
    if (miss >= least) continue;
    least = miss;
    best = {to, angle, metres};
  }
  return best;
}

/// The axis is in place; what else is wrong with `to` as a counterpart?
std::string ExplainBeyond(const Assembly& a, const Assembly& b, const Stuck& stuck, int to) {
  const AssemblyJoint& j = a.joints[stuck.joint];
  const AssemblyJoint& image = b.joints[to];
  if (!SameRange(j, image, kLimitTolerance * std::max(a.extent_m, b.extent_m))) {
    return fmt::format("but that one {} and not as wide as {}, which {}", RangeText(image),
                       a.JointName(stuck.joint), RangeText(j));
  }
  const int other = j.Other(stuck.body);
  const int other_image = image.Other(stuck.image);
  const size_t degree = a.bodies[other].joints.size();
  const size_t degree_image = b.bodies[other_image].joints.size();
  if (degree != degree_image) {
    return fmt::format("but that one leads to {}, which {} touch, and not {} as {}",
                       b.BodyName(other_image), Counted(degree_image, "joint", "joints"), degree,
                       a.BodyName(other));
  }
  const Vector3d apart = a.bodies[other].p_RoTo - j.p_RoJo;
  const Vector3d apart_image = b.bodies[other_image].p_RoTo - image.p_RoJo;
  const double out = (apart - apart.dot(j.axis) * j.axis).norm();
  const double out_image = (apart_image - apart_image.dot(image.axis) * image.axis).norm();
  if (std::abs(out - out_image) > kGeometryTolerance * b.extent_m) {
    return fmt::format(
        "but the body beyond it, {}, has its reference point {:.6g} m from that axis, and not "
        "{:.6g} "
        "m as {}",
        b.BodyName(other_image), Plain(out_image), Plain(out), a.BodyName(other));
  }
  return fmt::format(
      "but the body beyond it, {}, does not lie as {} does: its reference point is elsewhere along "
      "or round the axis when the joint stands alike, or joins other bodies",
      b.BodyName(other_image), a.BodyName(other));
}

}  // namespace

std::string DifferentCounts(const Assembly& a, const Assembly& b) {
  const std::string& name_a = a.robot->name;
  const std::string& name_b = b.robot->name;
  if (a.bodies.size() != b.bodies.size() || a.joints.size() != b.joints.size()) {
    const auto count = [](const Assembly& x) {
      return fmt::format("{} has {} with {} and {}", x.robot->name,
                         Counted(x.robot->modules.size(), "module", "modules"),
                         Counted(x.bodies.size(), "body", "bodies"),
                         Counted(x.joints.size(), "joint", "joints"));
    };
    return count(a) + ", " + count(b);
  }
  const Classes plain = PlainClasses(a, b);
  if (const auto joints = RarestDifference(plain.joints)) {
    const int side = joints->member[0] >= 0 && joints->count[0] > joints->count[1] ? 0 : 1;
    const Assembly& owner = side == 0 ? a : b;
    const int joint = joints->member[side];
    return fmt::format("joint {} of {} {}: {} has {} of this kind and range, {} has {}",
                       owner.JointName(joint), owner.robot->name, RangeText(owner.joints[joint]),
                       name_a, Counted(joints->count[0], "joint", "joints"), name_b,
                       Counted(joints->count[1], "joint", "joints"));
  }
  if (const auto bodies = RarestDifference(plain.bodies)) {
    const int side = bodies->member[0] >= 0 && bodies->count[0] > bodies->count[1] ? 0 : 1;
    const Assembly& owner = side == 0 ? a : b;
    const int body = bodies->member[side];
    const size_t degree = owner.bodies[body].joints.size();
    return fmt::format("body {} of {} is touched by {}: {} has {} with so many, {} has {}",
                       owner.BodyName(body), owner.robot->name, Counted(degree, "joint", "joints"),
                       name_a, Counted(bodies->count[0], "body", "bodies"), name_b,
                       Counted(bodies->count[1], "body", "bodies"));
  }
  return {};
}

std::string ExplainStuck(const Assembly& a, const Assembly& b, const std::optional<Stuck>& stuck) {
  const std::string& name_a = a.robot->name;
  const std::string& name_b = b.robot->name;
  if (!stuck) {
    return fmt::format(
        "no body of {} has its joints' axes as far from its reference point as {} of {}", name_b,
        a.BodyName(0), name_a);
  }
  const AssemblyJoint& j = a.joints[stuck->joint];
  std::string text = fmt::format(
      "joint {} of {} has no counterpart: in the most promising attempt {} of {} bodies match, "
      "among "
      "them {} with {} of {}, ",
      a.JointName(stuck->joint), name_a, stuck->bodies, a.bodies.size(), a.BodyName(stuck->body),
      b.BodyName(stuck->image), name_b);
  if (!stuck->settled) {
    return text + fmt::format("which has no joint left whose axis lies to the others as that of {}",
                              a.JointName(stuck->joint));
  }
  const Vector3d axis = stuck->R * j.axis;
  text += fmt::format("where a joint would have to {} {}", j.slide ? "slide along" : "turn about",
                      Text(axis));
  if (!j.slide) {
    const Vector3d through =
        b.bodies[stuck->image].p_RoTo + stuck->R * (j.p_RoJo - a.bodies[stuck->body].p_RoTo);
    text += fmt::format(" through {} m", Text(through));
  }
  const Miss nearest = NearestJoint(a, b, *stuck);
  if (nearest.joint < 0) return text + "; there is none left";
  const std::string name = b.JointName(nearest.joint);
  const bool turned = nearest.angle > kGeometryTolerance;
  const bool moved = nearest.metres > kGeometryTolerance * b.extent_m;
  if (turned || moved) {
    text += fmt::format("; the nearest, {}, is off by", name);
    if (turned) text += fmt::format(" {:.6g} degrees", nearest.angle * kDegrees);
    if (moved) text += fmt::format("{} {:.6g} m", turned ? " and" : "", nearest.metres);
    return text;
  }
  return text + fmt::format("; {} does, ", name) + ExplainBeyond(a, b, *stuck, nearest.joint);
}

}  // namespace morphbus::congruence
