#pragma once
// Why two assemblies are not congruent, so that a person can check it.

#include <optional>
#include <string>

#include "compiler/congruence/assembly.h"
#include "compiler/congruence/search.h"

namespace morphbus::congruence {

/// A difference that counting shows: numbers of bodies and joints, joints of some kind and range,
/// bodies with so many joints. Empty if the counts agree.
std::string DifferentCounts(const Assembly& a, const Assembly& b);

/// Where the search got stuck.
std::string ExplainStuck(const Assembly& a, const Assembly& b, const std::optional<Stuck>& stuck);

}  // namespace morphbus::congruence
