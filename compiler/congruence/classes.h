#pragma once
// Classes of bodies and joints of two assemblies that may correspond, by what no motion changes:
// kinds, ranges, distances. Members of different classes never correspond; those of one class need
// not, so a search has to look at them.

#include <cstdint>
#include <vector>

#include "compiler/congruence/screw_graph.h"

namespace morphbus::congruence {

/// Ranges of joints are the same within this much: what limits hold to (rad), and of the extent.
inline constexpr double kLimitTolerance = 1e-4;
/// Lengths coincide within this much of the extent of the largest module; directions in rad.
inline constexpr double kGeometryTolerance = 1e-6;

/// Lengths coincide within this much (m).
double LengthTolerance(const ScrewGraph& a, const ScrewGraph& b);
/// Ranges of joints that slide are the same within this much (m).
double SlideTolerance(const ScrewGraph& a, const ScrewGraph& b);

/// The class of each body and joint, as a number that means nothing but "the same class". By index
/// into ScrewGraph::bodies and joints; [0] and [1] for the two assemblies.
struct Classes {
  std::vector<uint64_t> bodies[2];
  std::vector<uint64_t> joints[2];
};

/// The classes that a person sees at once: joints by kind and width of range, bodies by the number
/// of joints that touch them.
Classes PlainClasses(const ScrewGraph& a, const ScrewGraph& b);

/// Those classes refined by the lengths of each joint, then again and again by the neighbours'
/// classes until they do not get finer (colour refinement: Weisfeiler, Leman 1968), at most 64
/// times. Bodies that differ in anything up to 64 joints away are told apart, but for directions:
/// an assembly and its mirror image have the same classes.
Classes RefinedClasses(const ScrewGraph& a, const ScrewGraph& b);

/// A number that congruent assemblies share and others hardly ever, for finding one among many: a
/// hash of the classes, refined by how the axes at each body lie to each other, too, so that most
/// mirror images have another one. Where ranges of joints begin does not enter it. Lengths enter it
/// rounded to 10 µm, widths of ranges to 1e-3 rad and cosines to 1e-5, so that two assemblies one
/// of whose figures lies on a limit of the rounding may be congruent and have two numbers; whether
/// two are congruent Compare decides (congruence.h).
uint64_t HashOfClasses(const ScrewGraph& graph);

}  // namespace morphbus::congruence
