#pragma once
// A sheet: headings, lines, tables and pictures, one below the other. It is written as a page
// (sheet_html.cc) or as paper (sheet_pdf.cc); both say the same, since neither adds anything.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "logger/show/drawing.h"

namespace morphbus::logger {

/// A picture with what it shows in words.
struct SheetPicture {
  Drawing drawing;
  std::string words;
};

/// A table. A column whose name begins with '#' is one of numbers, which stand to the right.
struct SheetTable {
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;
};

/// What belongs together: it is kept on one sheet of paper if it fits on one.
struct SheetBlock {
  std::string heading;
  std::optional<SheetPicture> picture = {};
  /// A line is something to do or to know; they stand beside the picture where there is room.
  std::vector<std::string> lines = {};
  std::optional<SheetTable> table = {};
};

/// A part with a heading of its own.
struct SheetPart {
  std::string heading;
  std::vector<std::string> paragraphs = {};
  std::vector<SheetBlock> blocks = {};
};

/// All of it.
struct Sheet {
  std::string title;
  std::vector<SheetPart> parts;
};

/// Told how much is done (0…1), before each block.
using SheetProgress = std::function<void(double)>;

/// One HTML file that needs no other: pictures are in it, light and dark, and it prints.
std::string SheetHtml(const Sheet& sheet, const SheetProgress& progress);

/// A PDF of pages of A4, with numbers at their feet. The same sheet gives the same bytes. Fails if
/// cairo cannot draw it.
Result<std::string> SheetPdf(const Sheet& sheet, const SheetProgress& progress);

}  // namespace morphbus::logger
