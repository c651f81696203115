#include "compiler/congruence/explain.h"

#include <fmt/format.h>

#include <map>

#include "compiler/congruence/explain_text.h"

namespace morphbus::congruence {
namespace {

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

}  // namespace morphbus::congruence
