#pragma once
// About how long and how large a sweep will be.

#include <cstdint>
#include <string>

#include "tools/sweep/row_source.h"
#include "tools/sweep/sweep_plan.h"

namespace morphbus::tools {

struct SweepEstimate {
  /// Rows that differ: each is run once.
  int64_t runs = 0;
  /// Wall time of all of them, one after the other (s), and the size of the database (bytes).
  double run_seconds = 0;
  int64_t bytes = 0;
};

/// Runs the beginning of the first, the middle and the last row, a second of simulated time each,
/// and takes these for all. Fails if one of them does.
Result<SweepEstimate> EstimateOf(const SweepPlan& plan);

/// Wall time of a simulated second of a row (s), by its first one, which is run in a process of its
/// own; 1 if that fails. The row has its inputs.
double WallTimeOfSecond(RowSource* source, const RowTask& task);

/// How long something takes, for people: "12 s", "5 min", "3.1 h".
std::string DurationText(double seconds);

}  // namespace morphbus::tools
