#pragma once
// Tables for a terminal.

#include <string>
#include <string_view>
#include <vector>

namespace morphbus {

/// Rows of cells as lines of text, with a newline after each. Every column is as wide as its widest
/// cell, in characters (UTF-8), and two spaces part it from the next, so that no name, however
/// long, pushes a row out of line. `indent` stands before each line; nothing follows a row's last
/// cell that is not empty. Rows may be of different lengths. Cells align to the left: numbers come
/// with the spaces that they need.
[[nodiscard]] std::string Columns(const std::vector<std::vector<std::string>>& rows,
                                  std::string_view indent = "");

}  // namespace morphbus
