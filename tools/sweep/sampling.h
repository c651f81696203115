#pragma once
// The points of a sweep: what each of its runs is told.

#include <vector>

#include "tools/sweep/sweep_file.h"

namespace morphbus::tools {

/// No sweep has more rows.
inline constexpr int64_t kMostRows = 1'000'000;

/// The value of an axis that is drawn at this fraction (0…1) of it.
Json ValueAt(const SweepAxis& axis, double fraction);

/// All points, with numbers in the place of the variants' names (0: the robot itself), in the order
/// of their rows: each [[run]], in it each sample, in that all values of the other axes, of which
/// the last one changes fastest. Computed by operations that are the same on every machine. A
/// sample depends on the seed, the axis' name and the sample's number alone if it is drawn at
/// random; of a Latin hypercube also on how many there are. Fails if there are too many.
Result<std::vector<RunPoint>> PointsOf(const SweepFile& sweep);

}  // namespace morphbus::tools
