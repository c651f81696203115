#include "tools/spy/table_layout.h"

#include <algorithm>
#include <numeric>

namespace morphbus::tools {

std::vector<int> TableWidths(const std::vector<TableColumn>& columns,
                             const std::vector<TableRow>& rows, int width) {
  // What each column needs to show everything, and what it needs at least.
  std::vector<int> needs, widths;
  for (const TableColumn& column : columns) {
    widths.push_back(std::max(column.least, Cells(column.title)));
    needs.push_back(std::max(widths.back(), column.roomy));
  }
  for (const TableRow& row : rows) {
    for (size_t i = 0; i < row.size(); ++i) needs[i] = std::max(needs[i], Cells(row[i].text));
  }
  if (width < 0) return needs;
  // A blank follows each column but the last one.
  const auto used = [&] {
    const int shown =
        static_cast<int>(std::count_if(widths.begin(), widths.end(), [](int w) { return w > 0; }));
    return std::accumulate(widths.begin(), widths.end(), 0) + std::max(0, shown - 1);
  };
  // Where not all fit at their least, the least important column goes, one after the other.
  while (used() > width) {
    int worst = -1;
    for (int i = 0; i < static_cast<int>(columns.size()); ++i) {
      if (widths[i] == 0 || columns[i].drop == 0) continue;
      if (worst < 0 || columns[i].drop > columns[worst].drop) worst = i;
    }
    if (worst < 0) break;
    widths[worst] = 0;
  }
  // What is left over goes to those who need it.
  for (size_t i = 0; i < columns.size(); ++i) {
    if (widths[i] > 0) widths[i] += std::clamp(width - used(), 0, needs[i] - widths[i]);
  }
  return widths;
}

ScreenLine TableLine(const std::vector<TableColumn>& columns, const std::vector<int>& widths,
                     const TableRow& row, bool selected) {
  ScreenLine line;
  for (size_t i = 0; i < columns.size(); ++i) {
    // A column that found no place is 0 wide.
    if (widths[i] == 0) continue;
    const Style style = selected ? Style::kSelected : row[i].style;
    if (!line.empty()) line.push_back({" ", selected ? Style::kSelected : Style::kPlain});
    const std::string text = row[i].draw ? row[i].draw(widths[i]) : row[i].text;
    line.push_back({FitCells(text, widths[i], columns[i].right), style});
  }
  return line;
}

ScreenLine TableHeading(const std::vector<TableColumn>& columns, const std::vector<int>& widths) {
  TableRow titles;
  for (const TableColumn& column : columns) titles.push_back({column.title, Style::kHeading, {}});
  ScreenLine line = TableLine(columns, widths, titles, false);
  // The blanks between titles belong to the heading as well.
  for (Span& span : line) span.style = Style::kHeading;
  return line;
}

}  // namespace morphbus::tools
