#pragma once
// The mappings of one assembly onto another: the first, all, and how many there are. Internal to
// compiler/congruence.

#include <functional>
#include <optional>

#include "compiler/congruence/congruence.h"
#include "compiler/congruence/search.h"

namespace morphbus::congruence {

/// Is mapping `x` onto `b` given before `y`? Those that keep the robot frame come first, then the
/// names of the modules decide that a's modules, in declared order, go to.
bool ComesBefore(const model::Robot& b, const Mapping& x, const Mapping& y);

/// A mapping that keeps the robot frame. Nothing if there is none, or `steps` ran out.
std::optional<Mapping> MappingInFrame(const ScrewGraph& a, const ScrewGraph& b,
                                      const Classes& classes, Steps& steps);

/// A mapping that keeps the robot frame or, if there is none, one that takes a body of which there
/// are few to the modules that come first by name. Nothing if there is no mapping, or `steps` ran
/// out. One is found without going through all.
std::optional<Mapping> FirstMapping(const ScrewGraph& a, const ScrewGraph& b,
                                    const Classes& classes, Steps& steps);

/// Calls `found` for each mapping until it returns false or `steps` run out; where joints within a
/// body go either way round it may be called twice for one. This searches the assemblies as wholes,
/// so where much is alike it may not end in reasonable time: it is for robots with few mappings.
/// `on_dead_end` is as for Search.
void ForEachMapping(const ScrewGraph& a, const ScrewGraph& b, const Classes& classes, Steps& steps,
                    const std::function<bool(const Mapping&)>& found,
                    const Search::OnDeadEnd& on_dead_end = nullptr);

struct MappingCount {
  int64_t count = 0;  ///< At most kMaxCounted.
  /// False: there are more than kMaxCounted or, where `count` is below that, perhaps more than it,
  /// as the steps ran out.
  bool exact = true;
};

/// Counts the congruences of `a` with itself. Two congruent assemblies have as many mappings onto
/// each other as either has onto itself.
///
/// They form a group, so the orbit-stabilizer theorem gives their number without listing them: it
/// is the number of bodies to which they take the seed (its orbit), times the number of joints to
/// which those that keep the seed take the first joint, times that to which those that keep both
/// take the second, and so on. Each mapping that is made joins bodies to orbits, so a ring of 100
/// modules takes a few; and counting ends once the product exceeds kMaxCounted.
MappingCount CountSymmetries(const ScrewGraph& a, Steps& steps);

}  // namespace morphbus::congruence
