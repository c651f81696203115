#pragma once
// The mapping that an answer gives. Internal to compiler/congruence.

#include <optional>

#include "compiler/congruence/backtracker.h"
#include "compiler/congruence/congruence.h"

namespace morphbus::congruence {

/// Is mapping `x` onto `b` given before `y`? Those that keep the robot frame come first, then the
/// names of the modules decide that a's modules, in declared order, go to.
bool ComesBefore(const model::Robot& b, const Mapping& x, const Mapping& y);

/// A mapping that keeps the robot frame. Nothing if there is none, or `steps` ran out.
std::optional<Mapping> MappingInFrame(const ScrewGraph& a, const ScrewGraph& b,
                                      const Classes& classes, Steps& steps);

/// A mapping that keeps the robot frame or, if there is none, one that takes a's first module to
/// the module whose name comes first of those that it can go to as a whole. Nothing if there is no
/// mapping, or `steps` ran out.
///
/// One is found without going through all: it is built from each place of one body in turn.
std::optional<Mapping> FirstMapping(const ScrewGraph& a, const ScrewGraph& b,
                                    const Classes& classes, Steps& steps);

}  // namespace morphbus::congruence
