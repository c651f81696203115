#pragma once
// How many congruences an assembly has with itself. Internal to compiler/congruence.

#include <cstdint>

#include "compiler/congruence/piece_search.h"

namespace morphbus::congruence {

/// A body that few are like, not a loose one if there is a choice: where it may go decides the
/// most. -1 if no body of b is like any of a.
int SeedBody(const Classes& classes, const Pieces& pieces);

/// All places of `body` on bodies of b of its class.
std::vector<Place> PlacesOf(const Correspondence& matched, const Pieces& pieces, int body);

struct SymmetryCount {
  int64_t count = 0;     ///< At most kMostCounted.
  bool complete = true;  ///< False: there may be more.
};

/// Congruences of `a` with itself. They form a group: their number is that of the places to which
/// they take one body times that of those which leave it in place. Each that is made takes known
/// places to further ones, so few have to be made.
SymmetryCount CountSymmetries(const Assembly& a, Steps& steps);

}  // namespace morphbus::congruence
