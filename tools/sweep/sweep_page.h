#pragma once
// A sweep on a page: what came of it, its best rows with pictures, and plots and a table of all of
// them that answer to the reader.

#include <optional>
#include <string>

#include "tools/sweep/figure_expression.h"
#include "tools/sweep/sweep_store.h"

namespace morphbus::tools {

/// What the page is about.
struct SweepPageOptions {
  /// Which rows are the best: those in which this is largest, or smallest. Nothing: as the sweep's
  /// file keeps them, or else those that came farthest.
  std::optional<FigureExpression> by;
  bool smallest = false;
  /// So many of them are shown with pictures, for which each runs again.
  int best = 5;
};

/// The page, as the bytes of one HTML file that needs no other: light or dark as the reader's
/// system is. Texts from the database are escaped. Without the scripts that are built by Node there
/// are no plots, and the page says so. Fails for a database without a row that is done, one that
/// cannot be read, and for an expression that is no number.
Result<std::string> SweepPageHtml(SweepStore* store, const SweepPageOptions& options);

}  // namespace morphbus::tools
