#pragma once
// Tables that fit a width: which columns are shown, and how wide.

#include <functional>
#include <string>
#include <vector>

#include "tools/spy/screen.h"

namespace morphbus::tools {

/// A column of a table.
struct TableColumn {
  std::string title;
  int least = 1;       ///< Cells that it needs to be of any use.
  bool right = false;  ///< Numbers stand at its right end.
  /// Where the table is too narrow, the column with the highest goes first; 0 stays.
  int drop = 0;
  /// Cells that it takes if they are there, for what is drawn (TableCell::draw).
  int roomy = 0;
};

/// A value of a table, already safe to show.
struct TableCell {
  std::string text;
  Style style = Style::kPlain;
  /// Makes the text for so many cells, instead of `text`: of meters and sparklines.
  std::function<std::string(int)> draw = {};
};
using TableRow = std::vector<TableCell>;

/// The widths of the columns in a table of `width` cells, with a blank between two columns; 0 for
/// one that is left out. Columns get what they need of what is left over, the first ones first.
/// A width below 0 has no limit.
std::vector<int> TableWidths(const std::vector<TableColumn>& columns,
                             const std::vector<TableRow>& rows, int width);

/// A row in these widths; in the style of a selected one if it is.
ScreenLine TableLine(const std::vector<TableColumn>& columns, const std::vector<int>& widths,
                     const TableRow& row, bool selected);
/// The titles, likewise.
ScreenLine TableHeading(const std::vector<TableColumn>& columns, const std::vector<int>& widths);

}  // namespace morphbus::tools
