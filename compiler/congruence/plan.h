#pragma once
// The order in which a search matches the joints of an assembly, and the parts of it that nothing
// outside of them can affect. Internal to compiler/congruence.

#include <vector>

#include "compiler/congruence/classes.h"
#include "compiler/congruence/screw_graph.h"

namespace morphbus::congruence {

/// To match `joint` of `body`, which has its counterpart by then.
struct Step {
  int body = 0;
  int joint = 0;
  /// Where an independent part begins with this step: the number of steps done when it is
  /// complete. Else 0.
  int part_end = 0;
};

/// All joints of an assembly, from one body outwards.
///
/// An independent part is a biconnected part of the graph (a joint that no loop runs through, or
/// loops that have joints in common; Hopcroft, Tarjan 1973) with all that hangs on it. It shares
/// one body with the rest. Once it is known where that body goes and how it is turned, nothing that
/// happens in the part can affect the rest, so a part that is matched is never looked at again: a
/// robot of 48 wheels that can each be placed in 2 ways takes 96 attempts and not 2^48.
struct Plan {
  int seed = 0;  ///< The body that is matched first, before any step.
  std::vector<Step> steps;
  /// By number of steps done: the first steps of the parts that are complete then, innermost first.
  std::vector<std::vector<int>> closing;
};

/// Goes through each part as a whole before the next one is begun.
Plan PlanByParts(const ScrewGraph& graph, int seed);

/// Breadth first, without parts: for a search that has to visit every mapping, or to say where it
/// failed.
Plan PlanAsOne(const ScrewGraph& graph, int seed);

/// A body of a that has the fewest bodies of its class, so the fewest places. If there is any, one
/// whose joints fix how it is turned: of a wheel on its axle they do not. -1 if no body of b is in
/// the class of any of a.
int SeedBody(const ScrewGraph& a, const ScrewGraph& b, const Classes& classes);

}  // namespace morphbus::congruence
