#include "compiler/congruence/congruence.h"

#include <algorithm>
#include <utility>

#include "compiler/congruence/classes.h"
#include "compiler/congruence/explain.h"
#include "compiler/congruence/mappings.h"
#include "compiler/congruence/mass_comparison.h"
#include "compiler/congruence/screw_graph.h"

namespace morphbus::congruence {
namespace {

/// Bounds like kMaxSteps.
constexpr int64_t kMaxStepsToList = 500'000;
constexpr int64_t kMaxStepsToExplain = 200'000;
/// All mappings are listed if they have no more joints than this together; of more, some for robots
/// as small as kSmall joints.
constexpr int64_t kMaxJointsListed = 100'000;
constexpr size_t kSmall = 64;

/// Have both assemblies as many bodies and joints of each class?
bool SameClasses(const Classes& classes) {
  const auto sorted = [](std::vector<uint64_t> members) {
    std::sort(members.begin(), members.end());
    return members;
  };
  return sorted(classes.bodies[0]) == sorted(classes.bodies[1]) &&
         sorted(classes.joints[0]) == sorted(classes.joints[1]);
}

/// What the answer says of a joint.
JointRef RefOf(const ScrewJoint& j) { return {j.module, j.joint, j.slide, j.locked}; }

/// Fills in the mappings: all, if they are not too many to list, else `first` and perhaps others.
void ListMappings(const ScrewGraph& a, const ScrewGraph& b, const Classes& classes, Mapping first,
                  Congruence& result) {
  const auto joints = static_cast<int64_t>(a.joints.size());
  const bool few = result.count_complete && result.count * joints <= kMaxJointsListed;
  std::vector<Mapping>& mappings = result.mappings;
  if (few || a.joints.size() <= kSmall) {
    Steps steps{kMaxStepsToList};
    ForEachMapping(a, b, classes, steps, [&](const Mapping& mapping) {
      mappings.push_back(mapping);
      return mappings.size() < static_cast<size_t>(kMaxCounted);
    });
  }

  // In order, each once. Where some are missing, those that would come before `first` go too.
  const auto before = [&](const Mapping& x, const Mapping& y) {
    return ComesBefore(*b.robot, x, y);
  };
  std::sort(mappings.begin(), mappings.end(), before);
  const auto same = [&](const Mapping& x, const Mapping& y) { return !before(x, y); };
  mappings.erase(std::unique(mappings.begin(), mappings.end(), same), mappings.end());
  if (few && static_cast<int64_t>(mappings.size()) == result.count) return;
  std::erase_if(mappings, [&](const Mapping& m) { return !before(first, m); });
  mappings.insert(mappings.begin(), std::move(first));
}

/// Decides within classes that are alike on both sides; fills in the result.
void Decide(const ScrewGraph& a, const ScrewGraph& b, const Classes& classes, int64_t max_steps,
            Congruence& result) {
  Steps steps{max_steps};
  std::optional<Mapping> first = FirstMapping(a, b, classes, steps);
  // A search that came to its end has decided, with or without a mapping.
  result.decided = first.has_value() || !steps.gave_up();
  if (!first) return;
  Steps steps_to_count{max_steps};
  // Every mapping of a to b is the first one after a symmetry of a, so that there are as many of
  // the one as of the other.
  const MappingCount count = CountSymmetries(a, steps_to_count);
  result.count = count.count;
  result.count_complete = count.exact;
  ListMappings(a, b, classes, std::move(*first), result);
}

/// Searches again among all that look alike at first sight, for a reason that speaks of one joint.
void Explain(const ScrewGraph& a, const ScrewGraph& b, Congruence& result) {
  Steps steps{kMaxStepsToExplain};
  DeadEnds ends(a, b);
  const auto found = [&](const Mapping& mapping) {
    // Only where lengths at the tolerance put bodies into unlike classes that fit.
    result.mappings.push_back(mapping);
    result.count_complete = false;
    ++result.count;
    return false;
  };
  const Classes plain = PlainClasses(a, b);
  ForEachMapping(a, b, plain, steps, found, [&](const auto&... end) { ends.Note(end...); });
  if (!result.congruent()) result.reason = ends.Explain(SeedBody(a, b, plain));
}

}  // namespace

Congruence Compare(const model::Model& model_a, const model::Robot& robot_a,
                   const model::Model& model_b, const model::Robot& robot_b, int64_t max_steps) {
  const ScrewGraph a = BuildScrewGraph(model_a, robot_a);
  const ScrewGraph b = BuildScrewGraph(model_b, robot_b);
  Congruence result;
  for (const ScrewJoint& j : a.joints) result.joints_a.push_back(RefOf(j));
  for (const ScrewJoint& j : b.joints) result.joints_b.push_back(RefOf(j));
  result.locked_computed = a.locked_computed && b.locked_computed;

  // From the cheapest way to a "no" to the dearest.
  result.reason = DifferentCounts(a, b);
  if (!result.reason.empty()) return result;
  const Classes refined = RefinedClasses(a, b);
  // Unlike numbers in any class are a proof that there is no mapping; like ones are none that there
  // is.
  if (SameClasses(refined)) Decide(a, b, refined, max_steps, result);
  if (!result.congruent() && result.decided) Explain(a, b, result);
  if (!result.congruent()) return result;

  // Masses are no part of the verdict.
  const MassComparer comparer(a, b);
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
  const ScrewGraph a = BuildScrewGraph(model_a, robot_a);
  const ScrewGraph b = BuildScrewGraph(model_b, robot_b);
  if (a.bodies.size() != b.bodies.size() || a.joints.size() != b.joints.size()) return std::nullopt;
  Steps steps{kMaxSteps};
  const std::optional<Mapping> mapping = MappingInFrame(a, b, PlainClasses(a, b), steps);
  if (!mapping) return std::nullopt;
  return MassComparer(a, b).Compare(*mapping);
}

uint64_t CongruenceHash(const model::Model& model, const model::Robot& robot) {
  return HashOfClasses(BuildScrewGraph(model, robot));
}

}  // namespace morphbus::congruence
