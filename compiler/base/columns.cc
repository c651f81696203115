#include "compiler/base/columns.h"

#include <algorithm>
#include <cstddef>

#include "compiler/base/utf8.h"

namespace morphbus {

std::string Columns(const std::vector<std::vector<std::string>>& rows, std::string_view indent) {
  std::vector<size_t> widths;
  for (const std::vector<std::string>& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    // A row may be longer than all before it, and adds columns then.
    for (size_t i = 0; i < row.size(); ++i)
      widths[i] = std::max(widths[i], CountCharacters(row[i]));
  }
  std::string text;
  for (const std::vector<std::string>& row : rows) {
    std::string line(indent);
    for (size_t i = 0; i < row.size(); ++i) {
      line += row[i];
      // Every cell is filled up, the last ones too; what that leaves at the end of the line is cut
      // off below.
      line.append(widths[i] - CountCharacters(row[i]) + 2, ' ');
    }
    text += line.substr(0, line.find_last_not_of(' ') + 1) + '\n';
  }
  return text;
}

}  // namespace morphbus
