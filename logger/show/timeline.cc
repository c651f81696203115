#include "logger/show/timeline.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace morphbus::logger {
namespace {

/// Measures in units of the view box; a letter of the small type is about so wide.
constexpr double kBarsWidth = 640, kBarsTop = 28, kBarsRight = 14, kRowHeight = 20,
                 kBarsBottom = 34, kLetter = 6.2;

}  // namespace

std::string TimelineSvg(const std::vector<TimelineRow>& rows, const std::string& title,
                        double begin, double end) {
  // The names decide how much room is left for the bars.
  size_t longest = 4;
  for (const TimelineRow& row : rows) longest = std::max(longest, row.name.size());
  // Names may take two fifths of the width at most; longer ones reach out of the picture at its
  // left.
  const double left = std::min(14 + kLetter * static_cast<double>(longest), kBarsWidth * 0.4);
  const double width = kBarsWidth - left - kBarsRight;
  const double height = kRowHeight * static_cast<double>(rows.size());
  // A run of one tick has no span.
  const double span = std::max(end - begin, 1e-9);
  const auto x_of = [&](double t) {
    return left + std::clamp((t - begin) / span, 0.0, 1.0) * width;
  };
  std::string svg = fmt::format(
      "<svg viewBox='0 0 {:.0f} {:.0f}' role='img' aria-label='{}'>"
      "<text class='title' x='8' y='18'>{}</text>",
      kBarsWidth, kBarsTop + height + kBarsBottom, EscapeHtml(title), EscapeHtml(title));
  // The grid lies under the bars.
  for (const double t : Ticks(begin, end, 8)) {
    svg += fmt::format(
        "<path class='grid' d='M{0:.1f} {1:.1f}V{2:.1f}'/>"
        "<text class='tick' x='{0:.1f}' y='{3:.1f}' text-anchor='middle'>{4:g}</text>",
        x_of(t), kBarsTop, kBarsTop + height, kBarsTop + height + 14, t);
  }
  for (size_t i = 0; i < rows.size(); ++i) {
    const double y = kBarsTop + kRowHeight * static_cast<double>(i);
    svg += fmt::format("<text class='label' x='{:.1f}' y='{:.1f}' text-anchor='end'>{}</text>",
                       left - 6, y + 14, EscapeHtml(rows[i].name));
    // A bar is always wide enough to be seen; what it is, a pointer held over it tells.
    for (const TimelineBar& bar : rows[i].bars) {
      const double x0 = x_of(bar.begin);
      const double w = std::max(x_of(bar.end) - x0, 0.75);
      svg += fmt::format(
          "<rect x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}' rx='2' fill='{}'>"
          "<title>{} ({:.2f} to {:.2f} s)</title></rect>",
          x0, y + 3, w, kRowHeight - 6, CssColor(bar.color), EscapeHtml(bar.text), bar.begin,
          bar.end);
      // Its text stands in it only if there is room.
      if (w < kLetter * static_cast<double>(bar.text.size()) + 8) continue;
      svg += fmt::format("<text class='bar-text' x='{:.1f}' y='{:.1f}' fill='{}'>{}</text>", x0 + 5,
                         y + 13.8, CssColor(TextColorOn(bar.color)), EscapeHtml(bar.text));
    }
    // Marks come last, over the bars.
    for (const PlotMark& mark : rows[i].marks) {
      svg += fmt::format(
          "<circle class='fault' cx='{:.1f}' cy='{:.1f}' r='4'><title>{}</title>"
          "</circle>",
          x_of(mark.x), y + kRowHeight / 2, EscapeHtml(mark.name));
    }
  }
  svg += fmt::format(
      "<text class='label' x='{:.1f}' y='{:.1f}' text-anchor='middle'>sim time (s)"
      "</text></svg>",
      left + width / 2, kBarsTop + height + 30);
  return svg;
}

}  // namespace morphbus::logger
