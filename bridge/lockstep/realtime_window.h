#pragma once
// Which ticks may have begun in a run in real time, as far as somebody knows who has missed some.
// Modules and the logger judge by it whether a message can be of this run.

#include <cstdint>

namespace morphbus::bridge {

/// A run gets on by at most one tick in so much time (microseconds).
inline constexpr int64_t kShortestTickUs = 1000;
/// No run is older than this (microseconds) when a module or the logger joins.
inline constexpr int64_t kLongestRunUs = 3'600'000'000;

}  // namespace morphbus::bridge
