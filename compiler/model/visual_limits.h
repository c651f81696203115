#pragma once
// How much there may be of what is seen of links, in sources and in files alike.

#include <cstddef>

#include "compiler/model/robot_model.h"

namespace morphbus::model {

/// What is seen of a link has at most so many parts, and so many points and triangles together; of
/// all links of a model so many, which take 12 MiB of the 16 MiB that the head of a log has.
inline constexpr size_t kMaxVisualParts = 50;
inline constexpr size_t kMaxVisualSize = 60'000;
inline constexpr size_t kMaxVisualSizeOfModel = 1'000'000;
/// Nothing that is seen of a link is farther from the module frame's origin along an axis (m).
inline constexpr double kMaxVisualReach_m = 1e6;

/// Points and triangles of a part together.
inline size_t SizeOf(const VisualPart& part) { return part.points.size() + part.triangles.size(); }

}  // namespace morphbus::model
