#pragma once
// Classes of bodies and joints of two assemblies that may correspond, by what no motion changes:
// kinds, ranges, distances. Members of different classes never correspond.

#include <cstdint>
#include <vector>

#include "compiler/congruence/assembly.h"

namespace morphbus::congruence {

/// Ranges of joints are the same within this much: what limits hold to (rad), and of the extent.
inline constexpr double kLimitTolerance = 1e-4;
/// Lengths coincide within this much of the extent of the largest module; directions in rad.
inline constexpr double kGeometryTolerance = 1e-6;

/// Ranges of joints that slide are the same within this much (m).
double SlideTolerance(const Assembly& a, const Assembly& b);

/// By index into Assembly::bodies and joints; [0] and [1] for the two assemblies.
struct Classes {
  std::vector<uint64_t> bodies[2];
  std::vector<uint64_t> joints[2];
};

/// Only what a person sees at once: joints by kind and range, bodies by number of joints.
Classes PlainClasses(const Assembly& a, const Assembly& b);

/// Refined by the neighbours' classes until they do not get finer (colour refinement: Weisfeiler,
/// Leman 1968), at most 64 times.
Classes RefinedClasses(const Assembly& a, const Assembly& b);

}  // namespace morphbus::congruence
