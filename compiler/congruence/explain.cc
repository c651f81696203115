// Each text names joints and bodies as `morphbus graph` does, with figures that can be checked
// there.

#include "compiler/congruence/explain.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "compiler/base/text.h"

namespace morphbus::congruence {
namespace {

/// Degrees in a radian.
constexpr double kDegrees = 180.0 / std::numbers::pi;

/// A number with its noun: "no joints", "1 joint", "2 joints".
std::string CountedOrNo(size_t count, const std::string& one, const std::string& many = {}) {
  if (count == 0) return "no " + (many.empty() ? one + "s" : many);
  return Counted(static_cast<int64_t>(count), one, many);
}

/// The number to print for `v`: 0 for what is only rounding, and for -0. Six significant digits are
/// printed, so less than half a millionth is rounding.
double Plain(double v) { return std::abs(v) < 5e-7 ? 0.0 : v; }

/// A vector with six digits: "(1, 0, 0.5)".
std::string VectorText(const Eigen::Vector3d& v) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g})", Plain(v.x()), Plain(v.y()), Plain(v.z()));
}

/// A value (rad or m) of a joint with its unit: "90 degrees", "0.1 m".
std::string ValueText(const ScrewJoint& j, double value) {
  return j.slide ? fmt::format("{:.6g} m", Plain(value))
                 : fmt::format("{:.6g} degrees", Plain(value * kDegrees));
}

/// What a joint does: "turns from -90 to 90 degrees"; "turns without limits, with both ends in one
/// body".
std::string RangeText(const ScrewJoint& j) {
  std::string text = j.slide ? "slides" : "turns";
  if (!j.bounded()) {
    text += " without limits";
  } else {
    const double unit = j.slide ? 1.0 : kDegrees;
    text += fmt::format(" from {:.6g} to {:.6g} {}", Plain(j.lower * unit), Plain(j.upper * unit),
                        j.slide ? "m" : "degrees");
  }
  return j.body_a == j.body_b ? text + ", with both ends in one body" : text;
}

/// A class that has not as many members in one assembly as in the other.
struct CountDifference {
  size_t count[2] = {0, 0};
  int member[2] = {-1, -1};  ///< The first one in each; -1 where there is none.
};

/// Of the classes that differ in number the one with the fewest members.
std::optional<CountDifference> RarestDifference(const std::vector<uint64_t> (&classes)[2]) {
  // All classes, with how many members each has on either side.
  std::map<uint64_t, CountDifference> members;
  for (const int side : {0, 1}) {
    for (size_t i = 0; i < classes[side].size(); ++i) {
      CountDifference& entry = members[classes[side][i]];
      if (entry.count[side]++ == 0) entry.member[side] = static_cast<int>(i);
    }
  }
  std::optional<CountDifference> rarest;
  const auto size = [](const CountDifference& d) { return d.count[0] + d.count[1]; };
  // Few members are quickly looked through by a person.
  for (const auto& [name, entry] : members) {
    if (entry.count[0] == entry.count[1]) continue;
    if (!rarest || size(entry) < size(*rarest)) rarest = entry;
  }
  return rarest;
}

using Demand = Failure::Demand;
using Eigen::Vector3d;

/// How far a joint of b is from where a counterpart would have to be.
struct Miss {
  int joint = -1;       ///< -1 if no joint is left.
  double angle = 0.0;   ///< Between the axes (rad).
  double metres = 0.0;  ///< Of the place through which the axis would have to pass; 0 for a slide.
};

/// Puts an attempt into words that came as far as a pair of bodies, a joint of which has no
/// counterpart.
class AttemptText {
 public:
  explicit AttemptText(const DeadEnd& end) : end_(end) {}

  [[nodiscard]] std::string Text() const {
    std::string text = Progress() + ", ";
    // Where the bodies' place is known, the joint's place is too: what is there, or nearest to
    // it?
    if (matched_.R().settled(end_.body)) {
      text += fmt::format("where a joint would have to {} {}",
                          j_.slide ? "slide along" : "turn about", VectorText(R() * j_.axis));
      if (!j_.slide) text += fmt::format(" through {} m", VectorText(Place()));
      return text + "; " + (end_.tried ? Tried("does") : NoneInPlace());
    }
    // Else there is no place to speak of, only a joint that was tried, or none.
    if (end_.tried) return text + Tried("is tried");
    return text +
           fmt::format("no joint is left there that {} and leads to a body that is touched by {}",
                       RangeText(j_), CountedOrNo(a_.bodies[other_].joints.size(), "joint"));
  }

 private:
  [[nodiscard]] Eigen::Matrix3d R() const { return matched_.R().Value(end_.body); }
  [[nodiscard]] std::string OtherName(int to) const {
    return b_.BodyName(b_.joints[to].Other(image_));
  }

  /// How far the attempt came, and the pair of bodies at which it ended.
  [[nodiscard]] std::string Progress() const {
    const std::string pair =
        fmt::format("{} with {} of {}", body_name_, image_name_, b_.robot->name);
    const size_t count = matched_.order().size();
    if (count == 1) return "in the most promising attempt, which begins with " + pair;
    return fmt::format("in the most promising attempt {} of {} bodies match, among them {}", count,
                       a_.bodies.size(), pair);
  }

  /// A point of the axis that a counterpart would have, in the robot frame of b.
  [[nodiscard]] Vector3d Place() const {
    return b_.bodies[image_].p_RoTo + R() * a_.FootFrom(end_.body, end_.joint);
  }

  /// The joint of the image, of those that are no counterpart yet, which misses that axis by
  /// least: radians and parts of a module's size count alike.
  [[nodiscard]] Miss NearestJoint() const {
    // Axes have no sense here: a joint may stand for one the other way round.
    const Vector3d axis = R() * j_.axis;
    const Vector3d place = Place();
    Miss best;
    double least = std::numeric_limits<double>::infinity();
    for (const int to : b_.bodies[image_].joints) {
      const ScrewJoint& image = b_.joints[to];
      if (matched_.JointTaken(to) || image.slide != j_.slide) continue;
      const double angle =
          std::atan2(axis.cross(image.axis).norm(), std::abs(axis.dot(image.axis)));
      const double metres = j_.slide ? 0.0 : (place - image.p_RoJo).cross(image.axis).norm();
      const double miss = angle + metres / std::max(b_.extent_m, 1e-12);
      if (miss >= least) continue;
      least = miss;
      best = {to, angle, metres};
    }
    return best;
  }

  /// What there is instead where no counterpart came into question though the place is known.
  [[nodiscard]] std::string NoneInPlace() const {
    const Miss nearest = NearestJoint();
    if (nearest.joint < 0) return "there is none left";
    // Either the nearest is in place and unfit for other reasons, or it is off by some angle and
    // way.
    const std::string name = b_.JointName(nearest.joint);
    const bool turned = nearest.angle > kGeometryTolerance;
    const bool moved = nearest.metres > kGeometryTolerance * b_.extent_m;
    if (!turned && !moved) return name + " does, but that one " + PassedOver(nearest.joint);
    std::string text = fmt::format("the nearest, {}, is off by", name);
    if (turned) text += fmt::format(" {:.6g} degrees", nearest.angle * kDegrees);
    if (moved) text += fmt::format("{} {:.6g} m", turned ? " and" : "", nearest.metres);
    return text;
  }

  /// Why `to`, whose axis is in place, did not come into question: by its range, its ends, or the
  /// bodies beyond. The conditions are those of Correspondence::AddCounterparts, in its order.
  [[nodiscard]] std::string PassedOver(int to) const {
    const ScrewJoint& image = b_.joints[to];
    if (!matched_.SameRange(end_.joint, to)) {
      return fmt::format("{} and not as wide as {}, which {}", RangeText(image), joint_name_,
                         RangeText(j_));
    }
    const int other_image = image.Other(image_);
    if ((other_ == end_.body) != (other_image == image_)) {
      return fmt::format("{}, and {} {}", RangeText(image), joint_name_, RangeText(j_));
    }
    const int matched = matched_.ImageOf(other_);
    if (matched >= 0 ? matched != other_image : matched_.BodyTaken(other_image)) {
      return OtherBodies(to);
    }
    return fmt::format("leads to {}, which is touched by {}, and not by {} as {}", OtherName(to),
                       CountedOrNo(b_.bodies[other_image].joints.size(), "joint"),
                       a_.bodies[other_].joints.size(), other_name_);
  }

  /// That `to` does not lead to the body that the joint leads to.
  [[nodiscard]] std::string OtherBodies(int to) const {
    const int matched = matched_.ImageOf(other_);
    if (matched < 0) {
      return fmt::format("leads to {}, which is another body's counterpart already", OtherName(to));
    }
    return fmt::format("leads to {}, and {} is matched with {}", OtherName(to), other_name_,
                       b_.BodyName(matched));
  }

  /// "X does, but" or "X is tried, but", and what it lacks.
  [[nodiscard]] std::string Tried(const std::string& verb) const {
    const Failure& failure = matched_.failure();
    return fmt::format("{} {}, but {}", b_.JointName(failure.counterpart.to), verb,
                       FailureText(failure));
  }

  [[nodiscard]] std::string FailureText(const Failure& failure) const {
    const std::string other_image = OtherName(failure.counterpart.to);
    const std::string& from = failure.beyond ? other_name_ : body_name_;
    const std::string& at = failure.beyond ? other_image : image_name_;
    const double wanted = Plain(failure.wanted);
    const double found = Plain(failure.found);
    // Figures are those of b first, then those of a that they should be equal to.
    const ScrewJoint& to = b_.joints[failure.counterpart.to];
    switch (failure.demand) {
      case Demand::kDirection:
        return fmt::format("its axis lies in {} {:.6g} degrees off where that of {} lies in {}", at,
                           found * kDegrees, joint_name_, from);
      case Demand::kDistance:
        return fmt::format(
            "its axis passes {:.6g} m from the reference point of {}, and not {:.6g} m as that "
            "of "
            "{} from {}",
            found, at, wanted, joint_name_, from);
      case Demand::kPlace:
        return fmt::format("its axis passes {} {:.6g} m beside where that of {} passes {}", at,
                           found, joint_name_, from);
      case Demand::kAlong:
        return fmt::format(
            "along its axis the reference point of {} lies {:.6g} m from that of {}, and not "
            "{:.6g} m as with {} and {}",
            other_image, found, image_name_, wanted, other_name_, body_name_);
      case Demand::kApart:
        return fmt::format(
            "across its axis the reference points of {} and {} lie {:.6g} m apart, and not "
            "{:.6g} "
            "m as those of {} and {}",
            image_name_, other_image, found, wanted, body_name_, other_name_);
      case Demand::kAcross:
        return fmt::format(
            "across its axis the reference point of {} lies {:.6g} m from where that of {} does",
            other_image, found, other_name_);
      case Demand::kBodies:
        return "it " + OtherBodies(failure.counterpart.to);
      case Demand::kTurned:
        return fmt::format(
            "when both stand alike, {} is turned about the axis {:.6g} degrees further than {}",
            other_image, found * kDegrees, other_name_);
      case Demand::kOffset:
        return fmt::format(
            "its limits map onto those of {} with an offset of {}, the bodies with one of {}",
            joint_name_, ValueText(to, failure.wanted), ValueText(to, failure.found));
      case Demand::kLocked:
        return fmt::format(
            "loops lock both, and it stands at {} where the counterpart of {} stands at {}",
            ValueText(to, failure.wanted), joint_name_, ValueText(to, failure.found));
    }
    return {};
  }

  const DeadEnd& end_;
  const Correspondence& matched_ = end_.matched;
  const ScrewGraph& a_ = matched_.a();
  const ScrewGraph& b_ = matched_.b();
  const ScrewJoint& j_ = a_.joints[end_.joint];
  int image_ = matched_.ImageOf(end_.body);  ///< Of the dead end's body.
  int other_ = j_.Other(end_.body);          ///< The body of a at the joint's other end.
  std::string joint_name_ = a_.JointName(end_.joint);
  std::string body_name_ = a_.BodyName(end_.body);
  std::string image_name_ = b_.BodyName(image_);
  std::string other_name_ = a_.BodyName(other_);
};

}  // namespace

std::string DifferentCounts(const ScrewGraph& a, const ScrewGraph& b) {
  // First the numbers as such.
  const std::string& name_a = a.robot->name;
  const std::string& name_b = b.robot->name;
  if (a.bodies.size() != b.bodies.size() || a.joints.size() != b.joints.size()) {
    const auto count = [](const ScrewGraph& x) {
      return fmt::format(
          "{} has {} with {} and {}", x.robot->name, CountedOrNo(x.robot->modules.size(), "module"),
          CountedOrNo(x.bodies.size(), "body", "bodies"), CountedOrNo(x.joints.size(), "joint"));
    };
    return count(a) + ", " + count(b);
  }

  // Then a joint of a kind and range, or a body touched by as many joints, as one of the two has
  // more of.
  const Classes plain = PlainClasses(a, b);
  const auto joints = RarestDifference(plain.joints);
  const auto bodies = RarestDifference(plain.bodies);
  if (!joints && !bodies) return {};
  const CountDifference& rarest = joints ? *joints : *bodies;
  const int side = rarest.count[0] > rarest.count[1] ? 0 : 1;
  const ScrewGraph& owner = side == 0 ? a : b;
  const int member = rarest.member[side];
  if (joints) {
    return fmt::format("joint {} of {} {}: {} has {} of this kind and range, {} has {}",
                       owner.JointName(member), owner.robot->name, RangeText(owner.joints[member]),
                       name_a, CountedOrNo(rarest.count[0], "joint"), name_b,
                       CountedOrNo(rarest.count[1], "joint"));
  }
  return fmt::format("body {} of {} is touched by {}: {} has {} with so many, {} has {}",
                     owner.BodyName(member), owner.robot->name,
                     CountedOrNo(owner.bodies[member].joints.size(), "joint"), name_a,
                     CountedOrNo(rarest.count[0], "body", "bodies"), name_b,
                     CountedOrNo(rarest.count[1], "body", "bodies"));
}

DeadEnds::DeadEnds(const ScrewGraph& a, const ScrewGraph& b) : a_(a), b_(b) {
  std::map<std::string, int> bodies;
  for (size_t i = 0; i < b.bodies.size(); ++i) {
    for (const model::LinkRef& link : b.bodies[i].links) {
      bodies.emplace(b.LinkName(link), static_cast<int>(i));
    }
  }
  for (const ScrewBody& body : a.bodies) {
    const auto namesake = bodies.find(a.LinkName(body.links.front()));
    namesakes_.push_back(namesake == bodies.end() ? -1 : namesake->second);
  }
}

void DeadEnds::Note(const Correspondence& matched, int body, int joint, bool tried) {
  // An attempt that found nothing to try for its first joint has nothing to tell.
  const std::vector<int>& order = matched.order();
  if (order.size() == 1 && matched.mark().joints == 0 && !tried) return;
  const int count = static_cast<int>(order.size());
  if (best_ && best_->promise >= 2 * count) return;
  // An attempt in which every body goes to its namesake says most to a person who changed a copy.
  const bool namesakes = std::all_of(order.begin(), order.end(), [&](int from) {
    return matched.ImageOf(from) == namesakes_[from];
  });
  const int promise = namesakes ? 2 * count : count;
  if (!best_ || best_->promise < promise) {
    best_.emplace(DeadEnd{matched, body, joint, tried, promise});
  }
}

std::string DeadEnds::Explain(int seed) const {
  const int joint = best_ ? best_->joint : a_.bodies[seed].joints[0];
  const std::string text =
      fmt::format("joint {} of {} has no counterpart: ", a_.JointName(joint), a_.robot->name);
  if (best_) return text + AttemptText(*best_).Text();
  // No body that the seed may go to has a joint like its first.
  return text + fmt::format("no body of {} that is touched by {}, as {}, has a joint that {}",
                            b_.robot->name, CountedOrNo(a_.bodies[seed].joints.size(), "joint"),
                            a_.BodyName(seed), RangeText(a_.joints[joint]));
}

}  // namespace morphbus::congruence
