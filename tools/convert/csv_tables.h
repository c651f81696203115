#pragma once
// A run as tables of comma-separated values (RFC 4180), one a quantity, that a spreadsheet, pandas
// or PlotJuggler opens as they are: one line of column names with units, sim time in the first
// column, a point as decimal mark. docs/data.md describes every table.

#include <functional>
#include <string_view>
#include <vector>

#include "compiler/base/result.h"
#include "logger/log/run_log.h"

namespace morphbus::tools {

/// Takes the next text of a table; fails if it cannot be written.
using TextSink = std::function<Result<void>(std::string_view)>;

/// One table.
struct CsvTable {
  /// The name of its file.
  const char* file;
  /// Writes the table of a log, which was loaded with its series. Floating-point numbers are the
  /// shortest text that reads back as the same double; what a module did not say at a time is an
  /// empty cell. Without a model, joints and links are named by their numbers.
  Result<void> (*write)(const logger::RunLog& log, const TextSink& write);
};

/// All tables, in the order in which docs/data.md lists them.
const std::vector<CsvTable>& CsvTables();

}  // namespace morphbus::tools
