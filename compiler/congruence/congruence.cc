#include "compiler/congruence/congruence.h"

#include <algorithm>
#include <utility>

#include "compiler/congruence/assembly.h"
#include "compiler/congruence/classes.h"
#include "compiler/congruence/explain.h"
#include "compiler/congruence/first_mapping.h"
#include "compiler/congruence/mass_comparison.h"
#include "compiler/congruence/search.h"
#include "compiler/congruence/symmetries.h"
#include "compiler/source/check.h"

namespace morphbus::congruence {
namespace {

/// Bounds like kMaxSteps.
constexpr int64_t kMaxStepsToList = 500'000;
constexpr int64_t kMaxStepsToExplain = 200'000;
/// All mappings are listed if they have no more joints than this together; of more, some for robots
/// as small as this.
constexpr int64_t kMaxJointsListed = 100'000;
constexpr size_t kSmall = 64;

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

/// At most `most` mappings, in order.
std::vector<Mapping> List(const Assembly& a, const Assembly& b, const Classes& classes,
                          size_t most) {
  std::vector<Mapping> mappings;
  Search search(a, b, classes, kMaxStepsToList);
  search.Run([&](const Mapping& mapping) {
    mappings.push_back(mapping);
    return mappings.size() < most;
  });
  std::stable_sort(mappings.begin(), mappings.end(),
                   [&](const Mapping& x, const Mapping& y) { return Before(*b.robot, x, y); });
  return mappings;
}

/// Fills in the mappings: all, if they are not too many to list, else `first` and perhaps others.
void ListMappings(const Assembly& a, const Assembly& b, const Classes& classes, Mapping first,
                  Congruence& result) {
  const auto joints = static_cast<int64_t>(a.joints.size());
  const bool few =
      result.count <= static_cast<int64_t>(kMaxKept) && result.count * joints <= kMaxJointsListed;
  if (few || a.joints.size() <= kSmall) result.mappings = List(a, b, classes, kMaxKept);
  if (few && static_cast<int64_t>(result.mappings.size()) == result.count) return;
  std::vector<Mapping>& mappings = result.mappings;
  mappings.erase(std::remove_if(mappings.begin(), mappings.end(),
                                [&](const Mapping& m) { return !Before(*b.robot, first, m); }),
                 mappings.end());
  mappings.insert(mappings.begin(), std::move(first));
}

/// Decides within classes that are alike on both sides; fills in the result.
void Decide(const Assembly& a, const Assembly& b, const Classes& classes, int64_t max_steps,
            Congruence& result) {
  Steps steps{max_steps};
  std::optional<Mapping> first = FirstMapping(a, b, classes, steps);
  result.decided = first.has_value() || !steps.gave_up();
  if (!first) return;
  Steps steps_to_count{max_steps};
  const SymmetryCount symmetries = CountSymmetries(a, steps_to_count);
  result.count = symmetries.count;
  result.count_complete = symmetries.complete;
  ListMappings(a, b, classes, std::move(*first), result);
}

/// Again among all that look alike at first sight, for a reason that speaks of one joint.
void Explain(const Assembly& a, const Assembly& b, Congruence& result) {
  Search search(a, b, PlainClasses(a, b), kMaxStepsToExplain);
  search.Run([&](const Mapping& mapping) {
    // Only where lengths at the tolerance tell bodies apart that fit.
    result.mappings.push_back(mapping);
    result.count_complete = false;
    ++result.count;
    return false;
  });
  if (result.congruent()) return;
  MORPHBUS_CHECK(search.stuck().has_value());
  result.reason = ExplainStuck(a, b, *search.stuck());
}

}  // namespace

Congruence Compare(const model::Model& model_a, const model::Robot& robot_a,
                   const model::Model& model_b, const model::Robot& robot_b, int64_t max_steps) {
  const Assembly a = Flatten(model_a, robot_a);
  const Assembly b = Flatten(model_b, robot_b);
  MORPHBUS_CHECK(HangsTogether(a) && HangsTogether(b));
  Congruence result;
  for (const AssemblyJoint& j : a.joints) result.joints_a.push_back(RefOf(j));
  for (const AssemblyJoint& j : b.joints) result.joints_b.push_back(RefOf(j));
  result.locked_computed = a.locked_computed && b.locked_computed;
  result.reason = DifferentCounts(a, b);
  if (!result.reason.empty()) return result;

  const Classes refined = RefinedClasses(a, b);
  if (SameClasses(refined)) Decide(a, b, refined, max_steps, result);
  if (!result.congruent() && result.decided) Explain(a, b, result);
  if (!result.congruent()) return result;
  MassComparer comparer(a, b);
  result.masses = comparer.Compare(result.mappings.front());
  for (const Mapping& mapping : result.mappings) {
    const MassComparison masses = comparer.Compare(mapping);
    result.masses_alike += masses.masses_equal ? 1 : 0;
    result.hulls_alike += masses.hulls_equal ? 1 : 0;
  }
  return result;
}

std::optional<MassComparison> CompareInFrame(const model::Model& model_a,
                                             const model::Robot& robot_a,
                                             const model::Model& model_b,
                                             const model::Robot& robot_b) {
  const Assembly a = Flatten(model_a, robot_a);
  const Assembly b = Flatten(model_b, robot_b);
  MORPHBUS_CHECK(HangsTogether(a) && HangsTogether(b));
  if (a.bodies.size() != b.bodies.size() || a.joints.size() != b.joints.size()) return std::nullopt;
  Steps steps{kMaxSteps};
  const std::optional<Mapping> mapping = MappingInFrame(a, b, PlainClasses(a, b), steps);
  if (!mapping) return std::nullopt;
  return MassComparer(a, b).Compare(*mapping);
}

}  // namespace morphbus::congruence
