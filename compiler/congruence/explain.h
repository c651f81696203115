#pragma once
// Why two assemblies are not congruent, so that a person can check it.

#include <string>

#include "compiler/congruence/assembly.h"
#include "compiler/congruence/search.h"

namespace morphbus::congruence {

/// A difference that counting shows: numbers of bodies and joints, joints of some kind and range,
/// bodies with so many joints. Empty if the counts agree.
std::string DifferentCounts(const Assembly& a, const Assembly& b);

/// The joint at which the search got stuck, and what its counterpart there lacks.
std::string ExplainStuck(const Assembly& a, const Assembly& b, const Stuck& stuck);

}  // namespace morphbus::congruence
