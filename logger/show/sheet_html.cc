#include <fmt/format.h>

#include <algorithm>

#include "logger/show/report_page.h"
#include "logger/show/robot_scenes.h"
#include "logger/show/sheet.h"

namespace morphbus::logger {
namespace {

/// What sheets have beside the style of all pages: a picture and its lines stand beside each other,
/// and each block is on one side of paper. Printed they are light, whatever the screen is.
constexpr const char* kSheetStyle = R"css(
h3{font-size:15px;font-weight:650;margin:0 0 8px;overflow-wrap:anywhere}
.block{margin-top:16px;break-inside:avoid}
.beside{display:grid;grid-template-columns:minmax(0,1.25fr) minmax(0,1fr);gap:20px;align-items:start}
.block ol{margin:0;padding-left:22px}.block li{margin:0 0 7px;overflow-wrap:anywhere}
.block .scroll{margin-top:10px}.block td{white-space:normal}
@media (max-width:760px){.beside{grid-template-columns:minmax(0,1fr)}}
@media print{:root{color-scheme:light;--bg:#fff;--card:#fff;--text:#1b1f26;--dim:#555d6b;
--line:#cfd4dc}main{max-width:none;padding:0}section{break-inside:auto}
h2,h3{break-after:avoid}}
)css";

/// The page of a sheet.
class SheetPage : public ReportPage {
 public:
  std::string Make(const Sheet& sheet, const SheetProgress& progress) {
    Begin(sheet.title, sheet.title, kSheetStyle);
    size_t all = 0, done = 0;
    for (const SheetPart& part : sheet.parts) all += part.blocks.size();
    for (const SheetPart& part : sheet.parts) {
      html_ += "<section><h2>" + EscapeHtml(part.heading) + "</h2>";
      for (const std::string& text : part.paragraphs) html_ += "<p>" + EscapeHtml(text) + "</p>";
      for (const SheetBlock& block : part.blocks) {
        progress(static_cast<double>(done++) / static_cast<double>(all));
        Block(block);
      }
      html_ += "</section>";
    }
    return End();
  }

 private:
  void Block(const SheetBlock& block) {
    html_ += "<article class='block'>";
    if (!block.heading.empty()) html_ += "<h3>" + EscapeHtml(block.heading) + "</h3>";
    // Without a picture the lines have the whole width.
    if (block.picture) {
      html_ += "<div class='beside'><figure>" +
               PictureHtml(block.picture->drawing, block.picture->words) + "<figcaption>" +
               EscapeHtml(block.picture->words) + "</figcaption></figure>";
    }
    if (!block.lines.empty()) {
      html_ += "<ol>";
      for (const std::string& line : block.lines) html_ += "<li>" + EscapeHtml(line) + "</li>";
      html_ += "</ol>";
    }
    if (block.picture) html_ += "</div>";
    if (block.table) Table(*block.table);
    html_ += "</article>";
  }

  void Table(const SheetTable& table) {
    html_ += TableHead(table.columns);
    for (const std::vector<std::string>& row : table.rows) {
      html_ += "<tr>";
      for (size_t i = 0; i < row.size(); ++i) {
        const char* kind = table.columns[i].starts_with('#') ? " class='n'" : "";
        html_ += fmt::format("<td{}>{}</td>", kind, EscapeHtml(row[i]));
      }
      html_ += "</tr>";
    }
    html_ += kTableEnd;
  }
};

}  // namespace

std::string SheetHtml(const Sheet& sheet, const SheetProgress& progress) {
  return SheetPage().Make(sheet, progress);
}

}  // namespace morphbus::logger
