#include "compiler/congruence/explain.h"

#include <fmt/format.h>

#include <map>

#include "compiler/congruence/explain_text.h"

namespace morphbus::congruence {
namespace {

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

  // Then a joint of a kind and range that one of the two has more of.
  const Classes plain = PlainClasses(a, b);
  if (const auto joints = RarestDifference(plain.joints)) {
    const int side = joints->member[0] >= 0 && joints->count[0] > joints->count[1] ? 0 : 1;
    const ScrewGraph& owner = side == 0 ? a : b;
    const int joint = joints->member[side];
    return fmt::format("joint {} of {} {}: {} has {} of this kind and range, {} has {}",
                       owner.JointName(joint), owner.robot->name, RangeText(owner.joints[joint]),
                       name_a, CountedOrNo(joints->count[0], "joint"), name_b,
                       CountedOrNo(joints->count[1], "joint"));
  }

  // Then a body touched by as many joints as one of the two has more of.
  if (const auto bodies = RarestDifference(plain.bodies)) {
    const int side = bodies->member[0] >= 0 && bodies->count[0] > bodies->count[1] ? 0 : 1;
    const ScrewGraph& owner = side == 0 ? a : b;
    const int body = bodies->member[side];
    const size_t degree = owner.bodies[body].joints.size();
    return fmt::format("body {} of {} is touched by {}: {} has {} with so many, {} has {}",
                       owner.BodyName(body), owner.robot->name, CountedOrNo(degree, "joint"),
                       name_a, CountedOrNo(bodies->count[0], "body", "bodies"), name_b,
                       CountedOrNo(bodies->count[1], "body", "bodies"));
  }
  return {};
}

}  // namespace morphbus::congruence
