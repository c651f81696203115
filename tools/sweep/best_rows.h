#pragma once
// The rows of a sweep in which something is largest, or smallest.

#include <vector>

#include "tools/sweep/figure_expression.h"
#include "tools/sweep/sweep_store.h"

namespace morphbus::tools {

/// A row, and the value by which it is ranked.
struct RankedRow {
  double value = 0;
  StoredRow row;
};

/// The `count` best rows, the best one first; of equal ones the first. A row in which `by` is not
/// known is none of them. Fails for what cannot be computed, or is no number.
Result<std::vector<RankedRow>> BestRows(SweepStore* store, const FigureExpression& by,
                                        bool smallest, int count);

}  // namespace morphbus::tools
