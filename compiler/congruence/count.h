#pragma once
// Numbers of mappings, which can be very large.

#include <algorithm>
#include <cstdint>

namespace morphbus::congruence {

/// The largest number that every reader of JSON takes exactly; stands for itself and all above.
inline constexpr int64_t kMostCounted = int64_t{1} << 53;

inline int64_t Plus(int64_t x, int64_t y) { return std::min(x + y, kMostCounted); }

/// For numbers from 0 to kMostCounted.
inline int64_t Times(int64_t x, int64_t y) {
  if (x == 0 || y == 0) return 0;
  return x > kMostCounted / y ? kMostCounted : x * y;
}

}  // namespace morphbus::congruence
