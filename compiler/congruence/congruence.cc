#include "compiler/congruence/congruence.h"

#include <algorithm>
#include <utility>

#include "compiler/congruence/assembly.h"
#include "compiler/congruence/classes.h"
#include "compiler/congruence/explain.h"
#include "compiler/congruence/mass_comparison.h"
#include "compiler/congruence/search.h"
#include "compiler/source/check.h"

namespace morphbus::congruence {
namespace {

constexpr int kRefinementRounds = 64;
/// Bounds on the search; each step matches one joint, well under a microsecond to a few.
constexpr int64_t kMaxSteps = 5'000'000;
constexpr int64_t kMaxStepsToExplain = 200'000;

bool HangsTogether(const Assembly& assembly) {
  if (assembly.bodies.empty()) return false;
  std::vector<bool> seen(assembly.bodies.size(), false);
  std::vector<int> todo = {0};
  seen[0] = true;
  size_t count = 1;
  while (!todo.empty()) {
    const int at = todo.back();
    todo.pop_back();
    for (const int joint : assembly.bodies[at].joints) {
      const int other = assembly.joints[joint].Other(at);
      if (seen[other]) continue;
      seen[other] = true;
      ++count;
      todo.push_back(other);
    }
  }
  return count == assembly.bodies.size();
}

bool SameClasses(const Classes& classes) {
  const auto same = [](std::vector<uint64_t> x, std::vector<uint64_t> y) {
    std::sort(x.begin(), x.end());
    std::sort(y.begin(), y.end());
    return x == y;
  };
  return same(classes.bodies[0], classes.bodies[1]) && same(classes.joints[0], classes.joints[1]);
}

JointRef RefOf(const AssemblyJoint& j) { return {j.module, j.joint, j.slide, j.locked}; }

/// Gathers mappings; the best one comes first.
class Collector {
 public:
  Collector(const model::Robot& b, Congruence& result) : b_(b), result_(result) {}

  bool Add(const Mapping& mapping) {
    if (result_.mappings.size() < kMaxKept) {
      result_.mappings.push_back(mapping);
    } else if (Before(mapping, result_.mappings[best_])) {
      result_.mappings[best_] = mapping;
    }
    if (Before(result_.mappings.back(), result_.mappings[best_])) {
      best_ = result_.mappings.size() - 1;
    }
    return ++result_.count < kMaxCounted;
  }

  void Sort() {
    std::stable_sort(result_.mappings.begin(), result_.mappings.end(),
                     [this](const Mapping& x, const Mapping& y) { return Before(x, y); });
  }

 private:
  [[nodiscard]] bool Before(const Mapping& x, const Mapping& y) const {
    if (x.keeps_frame != y.keeps_frame) return x.keeps_frame;
    for (size_t m = 0; m < x.module_to.size(); ++m) {
      const int to_x = x.module_to[m];
      const int to_y = y.module_to[m];
      if (to_x == to_y) continue;
      if (to_x < 0 || to_y < 0) return to_x >= 0;
      return b_.modules[to_x].name < b_.modules[to_y].name;
    }
    for (size_t j = 0; j < x.joints.size(); ++j) {
      if (x.joints[j].to != y.joints[j].to) return x.joints[j].to < y.joints[j].to;
      if (x.joints[j].sign != y.joints[j].sign) return x.joints[j].sign > y.joints[j].sign;
    }
    return false;
  }

  const model::Robot& b_;
  Congruence& result_;
  size_t best_ = 0;
};

/// Searches within `classes`; fills in the result.
std::optional<Stuck> SearchWithin(const Assembly& a, const Assembly& b, Classes classes,
                                  int64_t max_steps, Congruence& result) {
  Collector collector(*b.robot, result);
  Search search(a, b, std::move(classes), max_steps);
  search.Run([&](const Mapping& mapping) { return collector.Add(mapping); });
  collector.Sort();
  result.decided = result.congruent() || !search.gave_up();
  return search.stuck();
}

}  // namespace

Congruence Compare(const model::Model& model_a, const model::Robot& robot_a,
                   const model::Model& model_b, const model::Robot& robot_b) {
  const Assembly a = Flatten(model_a, robot_a);
  const Assembly b = Flatten(model_b, robot_b);
  MORPHBUS_CHECK(HangsTogether(a) && HangsTogether(b));
  Congruence result;
  for (const AssemblyJoint& j : a.joints) result.joints_a.push_back(RefOf(j));
  for (const AssemblyJoint& j : b.joints) result.joints_b.push_back(RefOf(j));
  result.locked_computed = a.locked_computed && b.locked_computed;
  result.reason = DifferentCounts(a, b);
  if (!result.reason.empty()) return result;

  Classes refined = RefinedClasses(a, b, kRefinementRounds);
  const bool alike = SameClasses(refined);
  if (alike) SearchWithin(a, b, std::move(refined), kMaxSteps, result);
  if (!result.congruent() && result.decided) {
    // Again among all that look alike at first sight, for a reason that speaks of one joint.
    const std::optional<Stuck> stuck =
        SearchWithin(a, b, PlainClasses(a, b), kMaxStepsToExplain, result);
    result.decided = true;
    if (!result.congruent()) {
      MORPHBUS_CHECK(stuck.has_value());
      result.reason = ExplainStuck(a, b, *stuck);
    }
  }
  if (result.congruent()) {
    result.reason.clear();
    result.masses = CompareMasses(a, b, result.mappings.front());
  }
  return result;
}

}  // namespace morphbus::congruence
