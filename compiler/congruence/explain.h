#pragma once
// Why two assemblies are not congruent, so that a person can check it.

#include <string>

#include "compiler/congruence/mapping_search.h"
#include "compiler/congruence/screw_graph.h"

namespace morphbus::congruence {

/// A difference that counting shows: numbers of bodies and joints, joints of some kind and range,
/// bodies with so many joints. Empty if the counts agree.
std::string DifferentCounts(const ScrewGraph& a, const ScrewGraph& b);

/// The joint at which an attempt ended, the pair of bodies from which its counterpart was looked
/// for, and what is there instead: where the joint would have to be and how far the nearest one is
/// off or, where one is in place, what that one lacks.
std::string ExplainDeadEnd(const ScrewGraph& a, const ScrewGraph& b, const DeadEnd& end);

}  // namespace morphbus::congruence
