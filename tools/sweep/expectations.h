#pragma once
// Whether the rows of a sweep are as its file expects.

#include <string>
#include <vector>

#include "tools/sweep/sweep_store.h"

namespace morphbus::tools {

/// A row that is not as expected, and why.
struct RowFailure {
  int64_t place = 0;
  std::string why;
  RunPoint point;
};

/// What became of one expectation.
struct ExpectationResult {
  /// As people read it: "num_faults == 0", "same hash over seed".
  std::string text;
  /// Rows that it is about.
  int64_t rows = 0;
  std::vector<RowFailure> failures;
  /// No row failed it. One that is about no row does not hold, for it shows nothing.
  bool holds = false;
};

/// The value of an expression for a row: figures by their names (FlatFigures), `hash`, `status`,
/// and what the row was told. Null for what a row without a good end lacks. Fails for a name that
/// there is not, with the nearest one, and for what cannot be computed.
Result<Json> ValueIn(const StoredRow& row, const FigureExpression& expression);

/// Looks at all rows. A row without a good end fulfils nothing. Fails for an expression that cannot
/// be computed.
Result<std::vector<ExpectationResult>> CheckExpectations(const SweepFile& sweep, SweepStore* store);

}  // namespace morphbus::tools
