// The joint at which the most promising attempt ended, and what its counterpart lacks.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "compiler/congruence/explain.h"
#include "compiler/congruence/explain_text.h"

namespace morphbus::congruence {
namespace {

using Eigen::Vector3d;

/// How far joint `joint` of b is from where `stuck.joint` would have its counterpart.
struct Miss {
  int joint = -1;
  double angle = 0.0;   ///< Between the axes (rad).
  double metres = 0.0;  ///< Of the place through which the axis would have to pass; 0 for a slide.
};

/// Where, in the robot frame of b, the axis of `stuck.joint`'s counterpart would pass.
Vector3d PlaceOf(const Assembly& a, const Assembly& b, const Stuck& stuck) {
  return b.bodies[stuck.image].p_RoTo + stuck.R * a.FootFrom(stuck.body, stuck.joint);
}

Miss NearestJoint(const Assembly& a, const Assembly& b, const Stuck& stuck) {
  const AssemblyJoint& j = a.joints[stuck.joint];
  const Vector3d axis = stuck.R * j.AxisFrom(stuck.body);
  const Vector3d place = PlaceOf(a, b, stuck);
  Miss best;
  double least = std::numeric_limits<double>::infinity();
  for (const int to : b.bodies[stuck.image].joints) {
    const AssemblyJoint& image = b.joints[to];
    if (stuck.taken[to] || image.slide != j.slide) continue;
    const double angle = std::atan2(axis.cross(image.axis).norm(), std::abs(axis.dot(image.axis)));
    const double metres = j.slide ? 0.0 : (place - image.p_RoJo).cross(image.axis).norm();
    const double miss = angle + metres / std::max(b.extent_m, 1e-12);
    if (miss >= least) continue;
    least = miss;
    best = {to, angle, metres};
  }
  return best;
}

/// The names that a failure speaks of.
struct Names {
  std::string joint, body, other;      ///< Of a.
  std::string to, image, other_image;  ///< Of b.
};

Names NamesOf(const Assembly& a, const Assembly& b, const Stuck& stuck, int to) {
  return {a.JointName(stuck.joint),
          a.BodyName(stuck.body),
          a.BodyName(a.joints[stuck.joint].Other(stuck.body)),
          b.JointName(to),
          b.BodyName(stuck.image),
          b.BodyName(b.joints[to].Other(stuck.image))};
}

/// Where `to` leads is not where the joint leads.
std::string OtherBodies(const Assembly& a, const Assembly& b, const Stuck& stuck, int to) {
  const Names names = NamesOf(a, b, stuck, to);
  const int other = a.joints[stuck.joint].Other(stuck.body);
  if (stuck.body_to[other] >= 0) {
    return fmt::format("leads to {}, and {} is matched with {}", names.other_image, names.other,
                       b.BodyName(stuck.body_to[other]));
  }
  return fmt::format("leads to {}, which is another body's counterpart already", names.other_image);
}

/// What the counterpart that was tried lacks, after "but".
std::string FailureText(const Assembly& a, const Assembly& b, const Stuck& stuck,
                        const Failure& failure) {
  using Demand = Failure::Demand;
  const Names n = NamesOf(a, b, stuck, failure.option.to);
  const std::string& from = failure.beyond ? n.other : n.body;
  const std::string& at = failure.beyond ? n.other_image : n.image;
  const double wanted = Plain(failure.wanted);
  const double found = Plain(failure.found);
  const AssemblyJoint& to = b.joints[failure.option.to];
  switch (failure.demand) {
    case Demand::kDirection:
      return fmt::format("its axis lies in {} {:.6g} degrees off where that of {} lies in {}", at,
                         found * kDegrees, n.joint, from);
    case Demand::kDistance:
      return fmt::format(
          "its axis passes {:.6g} m from the reference point of {}, and not {:.6g} m as that of {} "
          "from {}",
          found, at, wanted, n.joint, from);
    case Demand::kPlace:
      return fmt::format("its axis passes {} {:.6g} m beside where that of {} passes {}", at, found,
                         n.joint, from);
    case Demand::kAlong:
      return fmt::format(
          "along its axis the reference point of {} lies {:.6g} m from that of {}, and not {:.6g} "
          "m as with {} and {}",
          n.other_image, found, n.image, wanted, n.other, n.body);
    case Demand::kApart:
      return fmt::format(
          "across its axis the reference points of {} and {} lie {:.6g} m apart, and not {:.6g} m "
          "as "
          "those of {} and {}",
          n.image, n.other_image, found, wanted, n.body, n.other);
    case Demand::kAcross:
      return fmt::format(
          "across its axis the reference point of {} lies {:.6g} m from where that of {} does",
          n.other_image, found, n.other);
    case Demand::kBodies:
      return "it " + OtherBodies(a, b, stuck, failure.option.to);
    case Demand::kTurned:
      return fmt::format(
          "when both stand alike, {} is turned about the axis {:.6g} degrees further than {}",
          n.other_image, found * kDegrees, n.other);
    case Demand::kOffset:
      return fmt::format(
          "its limits map onto those of {} with an offset of {}, the bodies with one of {}",
          n.joint, ValueText(to, failure.wanted), ValueText(to, failure.found));
    case Demand::kLocked:
      return fmt::format(
          "loops lock both, and it stands at {} where the counterpart of {} stands at {}",
          ValueText(to, failure.wanted), n.joint, ValueText(to, failure.found));
  }
  return {};
}

/// The axis of `to` is in place; why did it not come into question?
std::string PassedOver(const Assembly& a, const Assembly& b, const Stuck& stuck, int to) {
  const AssemblyJoint& j = a.joints[stuck.joint];
  const AssemblyJoint& image = b.joints[to];
  const Names names = NamesOf(a, b, stuck, to);
  if (!SameRange(j, image, SlideTolerance(a, b))) {
    return fmt::format("that one {} and not as wide as {}, which {}", RangeText(image), names.joint,
                       RangeText(j));
  }
  const int other = j.Other(stuck.body);
  const int other_image = image.Other(stuck.image);
  if ((other == stuck.body) != (other_image == stuck.image)) {
    return fmt::format("that one {}, and {} {}", RangeText(image), names.joint, RangeText(j));
  }
  const bool matched = stuck.body_to[other] >= 0;
  if (matched ? stuck.body_to[other] != other_image : stuck.occupied[other_image]) {
    return "that one " + OtherBodies(a, b, stuck, to);
  }
  return fmt::format("that one leads to {}, which is touched by {}, and not by {} as {}",
                     names.other_image,
                     Counted(b.bodies[other_image].joints.size(), "joint", "joints"),
                     a.bodies[other].joints.size(), names.other);
}

/// No counterpart came into question, and the rotation is known: where would its axis have to be?
std::string NoneInPlace(const Assembly& a, const Assembly& b, const Stuck& stuck) {
  const Miss nearest = NearestJoint(a, b, stuck);
  if (nearest.joint < 0) return "; there is none left";
  const std::string name = b.JointName(nearest.joint);
  const bool turned = nearest.angle > kGeometryTolerance;
  const bool moved = nearest.metres > kGeometryTolerance * b.extent_m;
  if (!turned && !moved) {
    return fmt::format("; {} does, but ", name) + PassedOver(a, b, stuck, nearest.joint);
  }
  std::string text = fmt::format("; the nearest, {}, is off by", name);
  if (turned) text += fmt::format(" {:.6g} degrees", nearest.angle * kDegrees);
  if (moved) text += fmt::format("{} {:.6g} m", turned ? " and" : "", nearest.metres);
  return text;
}

std::string Attempt(const Assembly& a, const Assembly& b, const Stuck& stuck) {
  const std::string pair = fmt::format("{} with {} of {}", a.BodyName(stuck.body),
                                       b.BodyName(stuck.image), b.robot->name);
  if (stuck.bodies == 1) return "in the most promising attempt, which begins with " + pair;
  return fmt::format("in the most promising attempt {} of {} bodies match, among them {}",
                     stuck.bodies, a.bodies.size(), pair);
}

}  // namespace

std::string ExplainStuck(const Assembly& a, const Assembly& b, const Stuck& stuck) {
  const AssemblyJoint& j = a.joints[stuck.joint];
  const size_t degree = a.bodies[stuck.body].joints.size();
  std::string text =
      fmt::format("joint {} of {} has no counterpart: ", a.JointName(stuck.joint), a.robot->name);
  if (stuck.image < 0) {
    return text + fmt::format("no body of {} that is touched by {}, as {}, has a joint that {}",
                              b.robot->name, Counted(degree, "joint", "joints"),
                              a.BodyName(stuck.body), RangeText(j));
  }
  text += Attempt(a, b, stuck) + ", ";
  if (stuck.settled && !stuck.first) {
    text += fmt::format("where a joint would have to {} {}", j.slide ? "slide along" : "turn about",
                        Text(stuck.R * j.axis));
    if (!j.slide) text += fmt::format(" through {} m", Text(PlaceOf(a, b, stuck)));
    if (!stuck.failure) return text + NoneInPlace(a, b, stuck);
    return text + fmt::format("; {} does, but ", b.JointName(stuck.failure->option.to)) +
           FailureText(a, b, stuck, *stuck.failure);
  }
  if (stuck.failure) {
    return text + fmt::format("{} is tried, but ", b.JointName(stuck.failure->option.to)) +
           FailureText(a, b, stuck, *stuck.failure);
  }
  const int other = j.Other(stuck.body);
  return text +
         fmt::format("no joint is left there that {} and leads to a body that is touched by {}",
                     RangeText(j), Counted(a.bodies[other].joints.size(), "joint", "joints"));
}

}  // namespace morphbus::congruence
