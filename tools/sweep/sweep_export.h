#pragma once
// The rows of a sweep for other programs.

#include <string>

#include "tools/base/files.h"
#include "tools/sweep/sweep_store.h"

namespace morphbus::tools {

/// Writes all rows in the order of the plan: a table with a column for each input, figure and fact
/// (RFC 4180; what is not known is empty), or a JSON array with an object for each. But for the
/// columns wall_seconds and host the bytes depend on the sweep alone.
Result<void> WriteCsv(SweepStore* store, OutputFile* file);
Result<void> WriteJson(SweepStore* store, OutputFile* file);

/// One row as in that array.
Json RowJson(const StoredRow& row);

/// The figures of a row by name; empty for a row without any.
Json FiguresOf(const StoredRow& row);

}  // namespace morphbus::tools
