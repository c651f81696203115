#pragma once
// Do the bodies of two congruent assemblies weigh alike and look alike?

#include "compiler/congruence/assembly.h"
#include "compiler/congruence/congruence.h"

namespace morphbus::congruence {

/// Compares each body with its image: mass, centre of mass and inertia (links as solids of even
/// density, flat ones thickened to 0.05 of the module's extent), to 1e-6 of their sizes; and the
/// hulls of the links as a set, to 1e-6 of the extent.
MassComparison CompareMasses(const Assembly& a, const Assembly& b, const Mapping& mapping);

}  // namespace morphbus::congruence
