#include <cairo-pdf.h>
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "compiler/base/utf8.h"
#include "logger/show/paint.h"
#include "logger/show/sheet.h"

namespace morphbus::logger {
namespace {

// Everything here is in points, 1/72 inch, as PDF has them. A4 is 210 by 297 mm.
constexpr double kPageWidth = 595.28;
constexpr double kPageHeight = 841.89;
constexpr double kEdge = 42;
constexpr double kWidth = kPageWidth - 2 * kEdge;
/// Pages are filled down to here; the number stands below.
constexpr double kBottom = kPageHeight - 54;
/// A picture has three fifths of the width beside its lines, and at most so much height.
constexpr double kPictureWidth = 0.58 * kWidth;
constexpr double kPictureHeight = 300;
constexpr double kGap = 12;
/// Sizes of type, with the distance between lines as a multiple of it.
constexpr double kType = 9.5;
constexpr double kTableType = 8.5;
constexpr double kLeading = 1.38;
constexpr Color kInk = {0.11, 0.12, 0.15};
constexpr Color kDim = {0.33, 0.36, 0.42};
constexpr Color kRule = {0.80, 0.82, 0.86};

/// Lays a sheet out on pages, from top to bottom. Without a surface to draw on it only counts
/// them.
class PdfWriter {
 public:
  /// `pages` is what the feet call their number; 0 while they are counted.
  PdfWriter(cairo_t* cr, std::string title, int pages)
      : cr_(cr), title_(std::move(title)), pages_(pages) {}

  /// Writes it; returns the number of pages.
  int Write(const Sheet& sheet, const SheetProgress& progress) {
    size_t all = 0, done = 0;
    for (const SheetPart& part : sheet.parts) all += part.blocks.size();
    Lines(Wrapped(sheet.title, 18, true, kWidth), kEdge, 18, true, kInk);
    for (const SheetPart& part : sheet.parts) {
      // A heading is not left alone at the foot of a page.
      y_ += kGap;
      double head = 30;
      for (const std::string& text : part.paragraphs) {
        const TextLines lines = Wrapped(text, kType, false, kWidth);
        head += kType * kLeading * static_cast<double>(lines.size()) + 3;
      }
      const double first = part.blocks.empty() ? 40 : HeightOf(part.blocks[0]) + 40;
      MakeRoom(std::min(head + first, kBottom - kEdge));
      Lines(Wrapped(part.heading, 13, true, kWidth), kEdge, 13, true, kInk);
      for (const std::string& text : part.paragraphs) {
        Lines(Wrapped(text, kType, false, kWidth), kEdge, kType, false, kInk);
        y_ += 3;
      }
      for (const SheetBlock& block : part.blocks) {
        if (drawing()) progress(static_cast<double>(done++) / static_cast<double>(all));
        Block(block);
      }
    }
    EndPage();
    return page_;
  }

 private:
  using TextLines = std::vector<std::string>;

  [[nodiscard]] bool drawing() const { return pages_ > 0; }

  [[nodiscard]] double WidthOf(const std::string& text, double size, bool bold) const {
    return paint::Measure(cr_, text, size, bold).x_advance;
  }

  /// A text in lines of at most `width`. Words that are wider are parted between characters.
  [[nodiscard]] TextLines Wrapped(const std::string& text, double size, bool bold,
                                  double width) const {
    TextLines lines = {""};
    const auto fits = [&](const std::string& line) { return WidthOf(line, size, bold) <= width; };
    for (size_t at = 0; at <= text.size();) {
      const size_t end = std::min(text.find(' ', at), text.size());
      const std::string word = text.substr(at, end - at);
      at = end + 1;
      const std::string longer = lines.back().empty() ? word : lines.back() + " " + word;
      if (fits(longer)) {
        lines.back() = longer;
        continue;
      }
      if (!lines.back().empty()) lines.emplace_back();
      // Character by character: cairo draws nothing more once it was asked how wide a part of a
      // character is.
      for (size_t i = 0; i < word.size();) {
        const std::string character = word.substr(i, std::max<size_t>(Utf8Length(word, i), 1));
        if (!lines.back().empty() && !fits(lines.back() + character)) lines.emplace_back();
        lines.back() += character;
        i += character.size();
      }
    }
    return lines;
  }

  /// Writes lines from y_ on, and moves it down.
  void Lines(const TextLines& lines, double x, double size, bool bold, const Color& color) {
    for (const std::string& line : lines) {
      MakeRoom(size * kLeading);
      if (drawing()) paint::Text(cr_, x, y_ + size, line, size, paint::Align::kLeft, bold, color);
      y_ += size * kLeading;
    }
  }

  /// Goes on with a new page if less than `height` is left on this one, unless it is empty.
  void MakeRoom(double height) {
    if (y_ + height <= kBottom || y_ <= kEdge) return;
    EndPage();
    ++page_;
    y_ = kEdge;
  }

  void EndPage() {
    if (!drawing()) return;
    const std::string number = fmt::format("{} · page {} of {}", title_, page_, pages_);
    paint::Text(cr_, kPageWidth / 2, kPageHeight - 28, number, 8, paint::Align::kCentre, false,
                kDim);
    cairo_show_page(cr_);
  }

  /// How a picture is scaled to its place, and how high it is then.
  [[nodiscard]] static double ScaleOf(const SheetPicture& picture) {
    const Eigen::Vector2d size = paint::SizeOf(picture.drawing);
    return std::min(kPictureWidth / size.x(), kPictureHeight / size.y());
  }
  [[nodiscard]] static double HeightOf(const SheetPicture& picture) {
    return ScaleOf(picture) * paint::SizeOf(picture.drawing).y();
  }

  /// The lines of a block, numbered, as they stand in a column of `width`.
  [[nodiscard]] std::vector<TextLines> Numbered(const SheetBlock& block, double width) const {
    std::vector<TextLines> numbered;
    for (const std::string& line : block.lines) {
      numbered.push_back(Wrapped(line, kType, false, width - kIndent));
    }
    return numbered;
  }
  static constexpr double kIndent = 19;

  [[nodiscard]] static double HeightOf(const std::vector<TextLines>& numbered) {
    double height = 0;
    for (const TextLines& lines : numbered) {
      height += static_cast<double>(lines.size()) * kType * kLeading + 3;
    }
    return height;
  }

  /// Where the lines of a block stand.
  struct Column {
    double x = kEdge, width = kWidth;
  };
  [[nodiscard]] static Column ColumnOf(const SheetBlock& block) {
    if (!block.picture) return {};
    return {kEdge + kPictureWidth + kGap, kWidth - kPictureWidth - kGap};
  }

  /// Of a block without its table.
  [[nodiscard]] double HeightOf(const SheetBlock& block) const {
    const double lines = HeightOf(Numbered(block, ColumnOf(block).width));
    return 20 + std::max(block.picture ? HeightOf(*block.picture) + 14 : 0.0, lines);
  }

  void Block(const SheetBlock& block) {
    y_ += 8;
    const double with_table = block.table ? HeightOf(*block.table, Widths(*block.table)) : 0.0;
    // What fits on a page is not parted; of what does not, the table is.
    const double height = HeightOf(block);
    MakeRoom(height + with_table <= kBottom - kEdge ? height + with_table : height);
    if (!block.heading.empty()) {
      Lines(Wrapped(block.heading, 11, true, kWidth), kEdge, 11, true, kInk);
      y_ += 3;
    }
    const double top = y_;
    if (block.picture) Picture(*block.picture);
    const double below = y_;
    // Lines begin beside the picture; if they are so many that they need another page, nothing is
    // beside them there.
    y_ = top;
    const int page = page_;
    const Column column = ColumnOf(block);
    int number = 0;
    for (const TextLines& lines : Numbered(block, column.width)) {
      MakeRoom(kType * kLeading);
      if (drawing()) {
        paint::Text(cr_, column.x, y_ + kType, fmt::format("{}.", ++number), kType,
                    paint::Align::kLeft, false, kDim);
      }
      Lines(lines, column.x + kIndent, kType, false, kInk);
      y_ += 3;
    }
    if (page_ == page) y_ = std::max(y_, below);
    if (block.table) Table(*block.table);
  }

  void Picture(const SheetPicture& picture) {
    const double scale = ScaleOf(picture);
    if (drawing()) {
      cairo_save(cr_);
      cairo_translate(cr_, kEdge, y_);
      cairo_scale(cr_, scale, scale);
      paint::PaintDrawing(cr_, picture.drawing);
      cairo_restore(cr_);
      // The path that the picture left would be drawn by what comes next.
      cairo_new_path(cr_);
    }
    y_ += scale * paint::SizeOf(picture.drawing).y();
    Lines(Wrapped(picture.words, 8, false, kPictureWidth), kEdge, 8, false, kDim);
  }

  static std::string NameOfColumn(const std::string& column) {
    return column.starts_with('#') ? column.substr(1) : column;
  }

  /// The widths of the columns: what their cells need, and less for the widest ones if that is too
  /// much.
  [[nodiscard]] std::vector<double> Widths(const SheetTable& table) const {
    std::vector<double> widths;
    for (size_t i = 0; i < table.columns.size(); ++i) {
      double width = WidthOf(NameOfColumn(table.columns[i]), kTableType, true);
      for (const auto& row : table.rows) {
        width = std::max(width, WidthOf(row[i], kTableType, false));
      }
      widths.push_back(width + 1);
    }
    const double room = kWidth - kGap * static_cast<double>(widths.size());
    // The widest column is cut down to the next one, and so on, until all fit.
    while (std::accumulate(widths.begin(), widths.end(), 0.0) > room + 0.01) {
      const double widest = std::ranges::max(widths);
      const double even = room / static_cast<double>(widths.size());
      for (double& width : widths) {
        if (width == widest) width = std::max(even, 0.9 * width);
      }
    }
    return widths;
  }

  /// The cells of a row in lines, and how high it is.
  [[nodiscard]] std::vector<TextLines> Cells(const std::vector<std::string>& row,
                                             const std::vector<double>& widths, bool bold) const {
    std::vector<TextLines> cells;
    for (size_t i = 0; i < row.size(); ++i) {
      cells.push_back(Wrapped(row[i], kTableType, bold, widths[i]));
    }
    return cells;
  }
  [[nodiscard]] static double HeightOf(const std::vector<TextLines>& cells, double padding) {
    size_t lines = 1;
    for (const TextLines& cell : cells) lines = std::max(lines, cell.size());
    return static_cast<double>(lines) * kTableType * kLeading + padding;
  }
  static constexpr double kPadding = 4;

  [[nodiscard]] double HeightOf(const SheetTable& table, const std::vector<double>& widths) const {
    double height = 20;
    for (const auto& row : table.rows) height += HeightOf(Cells(row, widths, false), kPadding);
    return height;
  }

  void Row(const SheetTable& table, const std::vector<TextLines>& cells,
           const std::vector<double>& widths, bool bold) {
    const double height = HeightOf(cells, kPadding);
    double x = kEdge;
    for (size_t i = 0; drawing() && i < cells.size(); ++i) {
      double y = y_ + kTableType;
      for (const std::string& line : cells[i]) {
        // Numbers stand to the right.
        const double indent =
            table.columns[i].starts_with('#') ? widths[i] - WidthOf(line, kTableType, bold) : 0.0;
        paint::Text(cr_, x + indent, y, line, kTableType, paint::Align::kLeft, bold,
                    bold ? kDim : kInk);
        y += kTableType * kLeading;
      }
      x += widths[i] + kGap;
    }
    y_ += height;
    if (!drawing()) return;
    paint::SetColor(cr_, kRule);
    cairo_set_line_width(cr_, 0.5);
    cairo_move_to(cr_, kEdge, y_ - 2);
    cairo_line_to(cr_, kEdge + kWidth, y_ - 2);
    cairo_stroke(cr_);
  }

  void Table(const SheetTable& table) {
    const std::vector<double> widths = Widths(table);
    std::vector<std::string> names;
    for (const std::string& column : table.columns) names.push_back(NameOfColumn(column));
    const std::vector<TextLines> head = Cells(names, widths, true);
    y_ += 6;
    MakeRoom(2 * HeightOf(head, kPadding));
    Row(table, head, widths, true);
    for (const auto& row : table.rows) {
      const std::vector<TextLines> cells = Cells(row, widths, false);
      const int page = page_;
      MakeRoom(HeightOf(cells, kPadding));
      // On the next page the columns have their names again.
      if (page_ != page) Row(table, head, widths, true);
      Row(table, cells, widths, false);
    }
  }

  cairo_t* cr_;
  std::string title_;
  int pages_;
  int page_ = 1;
  double y_ = kEdge;
};

/// Takes what cairo writes; `bytes` is a std::string.
cairo_status_t AppendPdf(void* bytes, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace

Result<std::string> SheetPdf(const Sheet& sheet, const SheetProgress& progress) {
  std::string bytes;
  cairo_surface_t* surface =
      cairo_pdf_surface_create_for_stream(AppendPdf, &bytes, kPageWidth, kPageHeight);
  cairo_pdf_surface_set_metadata(surface, CAIRO_PDF_METADATA_TITLE, sheet.title.c_str());
  // The time of day would make each file another one.
  cairo_pdf_surface_set_metadata(surface, CAIRO_PDF_METADATA_CREATE_DATE, "1970-01-01T00:00:00Z");
  cairo_t* cr = cairo_create(surface);
  // Pages are counted first, so that each can say how many there are.
  const int pages = PdfWriter(cr, sheet.title, 0).Write(sheet, progress);
  PdfWriter(cr, sheet.title, pages).Write(sheet, progress);
  cairo_status_t status = cairo_status(cr);
  cairo_destroy(cr);
  cairo_surface_finish(surface);
  if (status == CAIRO_STATUS_SUCCESS) status = cairo_surface_status(surface);
  cairo_surface_destroy(surface);
  if (status != CAIRO_STATUS_SUCCESS) {
    return Fail(fmt::format("cannot draw: {}", cairo_status_to_string(status)));
  }
  return bytes;
}

}  // namespace morphbus::logger
