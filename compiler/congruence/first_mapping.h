#pragma once
// The mapping that an answer gives. Internal to compiler/congruence.

#include <optional>

#include "compiler/congruence/congruence.h"
#include "compiler/congruence/piece_search.h"

namespace morphbus::congruence {

/// The order in which mappings onto `b` are given: those that keep the frame first, then by the
/// names of the modules that a's modules, in declared order, go to.
bool Before(const model::Robot& b, const Mapping& x, const Mapping& y);

/// One that keeps the robot frame; nothing if there is none, or `steps` ran out.
std::optional<Mapping> MappingInFrame(const Assembly& a, const Assembly& b, const Classes& classes,
                                      Steps& steps);

/// That one or, if there is none, one that takes a's first module to the module whose name comes
/// first of those that it can go to as a whole. Nothing if there is no mapping, or `steps` ran out.
std::optional<Mapping> FirstMapping(const Assembly& a, const Assembly& b, const Classes& classes,
                                    Steps& steps);

}  // namespace morphbus::congruence
