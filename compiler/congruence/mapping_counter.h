#pragma once
// Counts the congruences of an assembly with itself. Internal to compiler/congruence.

#include "compiler/congruence/backtracker.h"

namespace morphbus::congruence {

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
/// is the number of places to which they take one body (its orbit) times the number of those that
/// leave this body in place. The latter are counted in the same manner, outwards over the tree of
/// pieces: at a body in place the number of pieces at it that can stand for each other, times for
/// each piece the number of ways to match it with itself, times the same at each body it leads to.
///
/// Few mappings have to be made for that. Each that is made leads from every place to another, so
/// the orbit of a body at least doubles with each one that takes it somewhere new; and counting
/// ends once the product exceeds kMaxCounted.
MappingCount CountSymmetries(const ScrewGraph& a, Steps& steps);

}  // namespace morphbus::congruence
