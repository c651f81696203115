#include "logger/show/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>

namespace morphbus::logger {
namespace {

/// Borders of a plot, in units of its view box: room for the numbers, the legend and the axes'
/// names.
constexpr int kLeft = 62;
constexpr int kRight = 14;
constexpr int kTop = 30;
constexpr int kBottom = 38;
/// Stretches into which a line is thinned, each of at most four points.
constexpr size_t kColumns = 600;

/// An interval of an axis that grows with what is added; empty at first.
struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void Add(double v) {
    low = std::min(low, v);
    high = std::max(high, v);
  }
  [[nodiscard]] bool empty() const { return !(low <= high); }
  [[nodiscard]] double span() const { return high - low; }
  // Widens the interval on both sides to a span of at least `least`.
  void Widen(double least) {
    const double missing = std::max(least - span(), 0.0) / 2;
    low -= missing;
    high += missing;
  }
};

/// Where numbers go on the picture: the ranges of both axes (low at the left and at the bottom),
/// and the rectangle that shows them, in units of the view box with y down.
struct Frame {
  Range x, y;
  double left, top, width, height;
  [[nodiscard]] double X(double v) const { return left + (v - x.low) / x.span() * width; }
  [[nodiscard]] double Y(double v) const { return top + (y.high - v) / y.span() * height; }
};

/// Whether a point can be drawn.
bool IsFinite(const std::pair<double, double>& point) {
  return std::isfinite(point.first) && std::isfinite(point.second);
}

/// Keeps first, lowest, highest and last point of each of kColumns stretches of the line, and the
/// first point of each that cannot be drawn: there the line is broken.
std::vector<std::pair<double, double>> Thin(const std::vector<std::pair<double, double>>& points) {
  // A line that is short enough stays as it is.
  if (points.size() <= 4 * kColumns) return points;
  std::vector<std::pair<double, double>> out;
  for (size_t column = 0; column < kColumns; ++column) {
    const size_t begin = column * points.size() / kColumns;
    const size_t end = (column + 1) * points.size() / kColumns;
    // The lowest and highest keep peaks visible that a mere selection would lose. A point without a
    // finite value is neither, and compares with nothing.
    std::set<size_t> keep = {begin, end - 1};
    std::optional<size_t> low, high, gap;
    for (size_t i = begin; i < end; ++i) {
      if (!IsFinite(points[i])) {
        gap = gap.value_or(i);
        continue;
      }
      if (!low || points[i].second < points[*low].second) low = i;
      if (!high || points[i].second > points[*high].second) high = i;
    }
    for (const std::optional<size_t>& i : {low, high, gap}) {
      if (i) keep.insert(*i);
    }
    for (const size_t i : keep) out.push_back(points[i]);
  }
  return out;
}

/// The number at a tick of an axis, with as few digits as the step between ticks needs.
std::string TickText(double value, double step) {
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 9);
  // Rounding must not make "-0" of the tick at zero.
  if (std::abs(value) < step * 1e-6) value = 0;
  return fmt::format("{:.{}f}", value, decimals);
}

/// Grid lines with their numbers, the frame, and what the axes show.
void DrawAxes(const Frame& f, const PlotOptions& options, std::string* svg) {
  // The ticks of both axes, and the steps that their numbers need.
  const std::vector<double> xs = Ticks(f.x.low, f.x.high, 8);
  const std::vector<double> ys = Ticks(f.y.low, f.y.high, 5);
  const double x_step = xs.size() > 1 ? xs[1] - xs[0] : 1.0;
  const double y_step = ys.size() > 1 ? ys[1] - ys[0] : 1.0;
  // Ticks of x have lines from top to bottom, those of y from left to right.
  for (const double x : xs) {
    *svg += fmt::format(
        "<path class='grid' d='M{0:.1f} {1:.1f}V{2:.1f}'/>"
        "<text class='tick' x='{0:.1f}' y='{3:.1f}' text-anchor='middle'>{4}</text>",
        f.X(x), f.top, f.top + f.height, f.top + f.height + 14, TickText(x, x_step));
  }
  for (const double y : ys) {
    *svg += fmt::format(
        "<path class='grid' d='M{0:.1f} {1:.1f}H{2:.1f}'/>"
        "<text class='tick' x='{3:.1f}' y='{4:.1f}' text-anchor='end'>{5}</text>",
        f.left, f.Y(y), f.left + f.width, f.left - 6, f.Y(y) + 3.5, TickText(y, y_step));
  }
  // The frame lies over the grid; the names of the axes lie outside.
  *svg += fmt::format("<rect class='frame' x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}'/>",
                      f.left, f.top, f.width, f.height);
  *svg += fmt::format("<text class='label' x='{:.1f}' y='{:.1f}' text-anchor='middle'>{}</text>",
                      f.left + f.width / 2, f.top + f.height + 30, EscapeHtml(options.x_label));
  *svg += fmt::format(
      "<text class='label' transform='translate(13 {:.1f}) rotate(-90)' "
      "text-anchor='middle'>{}</text>",
      f.top + f.height / 2, EscapeHtml(options.y_label));
}

/// The title at the left, the lines' names from the right.
void DrawLegend(const std::vector<PlotLine>& lines, const PlotOptions& options, std::string* svg) {
  *svg +=
      fmt::format("<text class='title' x='{}' y='18'>{}</text>", kLeft, EscapeHtml(options.title));
  // The last line's name stands outermost. A letter is about 7 units wide: text cannot be measured
  // here.
  double x = options.width - kRight;
  for (auto line = lines.rbegin(); line != lines.rend(); ++line) {
    if (line->name.empty()) continue;
    x -= 7.0 * static_cast<double>(line->name.size()) + 4;
    *svg += fmt::format(
        "<text class='legend' x='{:.1f}' y='18'>{}</text>"
        "<path class='{}' d='M{:.1f} 14h18'/>",
        x, EscapeHtml(line->name), line->css_class, x - 23);
    x -= 36;
  }
}

/// Dashed lines with their names at the upper end. A name that would be written over another one
/// stands a line lower, and one that would leave the frame to the left of its line.
void DrawMarks(const Frame& f, const PlotOptions& options, std::string* svg) {
  constexpr double kLetterWidth = 6.2, kLine = 12, kGap = 4;
  std::vector<std::pair<double, double>> taken[3];  // By line: from where to where.
  for (const PlotMark& mark : options.marks) {
    if (mark.x < f.x.low || mark.x > f.x.high) continue;
    const double x = f.X(mark.x);
    *svg +=
        fmt::format("<path class='mark' d='M{:.1f} {:.1f}V{:.1f}'/>", x, f.top, f.top + f.height);
    const double width = kLetterWidth * static_cast<double>(mark.name.size());
    // Behind the line unless the name would leave the frame there and has room before it.
    const bool left = x + kGap + width > f.left + f.width && x - kGap - width > f.left;
    const double begin = left ? x - kGap - width : x + kGap;
    // The first line in which there is room; where there is none, the dashed line must do.
    for (size_t line = 0; line < std::size(taken); ++line) {
      const bool free =
          std::none_of(taken[line].begin(), taken[line].end(), [&](const auto& other) {
            return begin < other.second + kGap && other.first < begin + width + kGap;
          });
      if (!free) continue;
      taken[line].emplace_back(begin, begin + width);
      *svg += fmt::format("<text class='mark-text' x='{:.1f}' y='{:.1f}'{}>{}</text>",
                          left ? x - kGap : begin, f.top + kLine * static_cast<double>(line + 1),
                          left ? " text-anchor='end'" : "", EscapeHtml(mark.name));
      break;
    }
  }
}

/// A plot without lines: its title, and that there is nothing to show.
std::string EmptyPlot(const PlotOptions& options) {
  return fmt::format(
      "<svg viewBox='0 0 {0} 60' role='img'><text class='title' x='{1}' y='18'>{2}</text>"
      "<text class='label' x='{1}' y='42'>nothing to show</text></svg>",
      options.width, kLeft, EscapeHtml(options.title));
}

}  // namespace

std::string EscapeHtml(const std::string& text) {
  static const std::map<char, const char*> reserved = {
      {'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}, {'\'', "&#39;"}};
  std::string out;
  for (const char c : text) {
    const auto found = reserved.find(c);
    if (found != reserved.end()) {
      out += found->second;
    } else {
      out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  }
  return out;
}

std::vector<double> Ticks(double low, double high, int count) {
  std::vector<double> ticks;
  const double span = high - low;
  // Ranges that are empty or not finite (a NaN fails every comparison) have no ticks.
  if (!(span > 0) || !std::isfinite(span) || count < 1) return ticks;
  // The step is 1, 2 or 5 times a power of ten, so that ticks are round numbers.
  const double raw = span / count;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double fraction = raw / power;
  const double step = power * (fraction <= 1 ? 1 : fraction <= 2 ? 2 : fraction <= 5 ? 5 : 10);
  // A tick that float noise puts just beyond either end still counts.
  const double first = std::ceil(low / step - 1e-9);
  for (int i = 0; i <= count + 1; ++i) {
    const double value = (first + i) * step;
    if (value > high + step * 1e-9) break;
    ticks.push_back(value);
  }
  return ticks;
}

std::string PlotSvg(const std::vector<PlotLine>& lines, const PlotOptions& options) {
  Frame f{{},
          {},
          kLeft,
          kTop,
          static_cast<double>(options.width - kLeft - kRight),
          static_cast<double>(options.height - kTop - kBottom)};
  // The frame holds all that is finite, with a margin above and below.
  for (const PlotLine& line : lines) {
    for (const auto& point : line.points) {
      if (!IsFinite(point)) continue;
      f.x.Add(point.first);
      f.y.Add(point.second);
    }
  }
  if (f.x.empty()) return EmptyPlot(options);
  f.x.Widen(1e-9);
  f.y.Widen(std::max(options.least_y_span, 1e-9));
  const double margin = f.y.span() * 0.06;
  f.y.low -= margin;
  f.y.high += margin;
  // A metre is as long up as to the right.
  if (options.equal_axes) {
    const double scale = std::max(f.x.span() / f.width, f.y.span() / f.height);
    f.x.Widen(scale * f.width);
    f.y.Widen(scale * f.height);
  }
  std::string svg = fmt::format("<svg viewBox='0 0 {} {}' role='img' aria-label='{}'>",
                                options.width, options.height, EscapeHtml(options.title));
  DrawAxes(f, options, &svg);
  // Marks lie under the lines.
  DrawMarks(f, options, &svg);
  for (const PlotLine& line : lines) {
    // Where a value is missing the line is broken.
    std::string path;
    bool pen = false;
    for (const auto& point : Thin(line.points)) {
      const bool drawn = IsFinite(point);
      if (drawn) {
        path +=
            fmt::format("{}{:.1f} {:.1f}", pen ? "L" : "M", f.X(point.first), f.Y(point.second));
      }
      pen = drawn;
    }
    svg += fmt::format("<path class='{}' d='{}'/>", line.css_class, path);
  }
  // The legend comes last, so that no line covers it.
  DrawLegend(lines, options, &svg);
  return svg + "</svg>";
}

}  // namespace morphbus::logger
