#pragma once
// Line plots as inline SVG for self-contained pages. Colours are CSS classes, so that a page
// decides them, light or dark.

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace morphbus::logger {

/// One line of a plot.
struct PlotLine {
  std::string name;       ///< For the legend.
  std::string css_class;  ///< E.g. "line-a".
  std::vector<std::pair<double, double>> points;
};

/// A shaded stretch or mark along x.
struct PlotMark {
  double x = 0.0;
  std::string name;
};

struct PlotOptions {
  std::string title;
  std::string x_label;
  std::string y_label;
  int width = 640;
  int height = 240;
  bool equal_axes = false;  ///< One metre is as long along y as along x.
  double least_y_span = 0;  ///< So that noise is not blown up to fill the plot.
  std::vector<PlotMark> marks;
};

/// The plot as an <svg> element. Lines are thinned to what the picture can show (minimum and
/// maximum of each column are kept). An empty plot says so.
std::string PlotSvg(const std::vector<PlotLine>& lines, const PlotOptions& options);

/// Text with the five characters that HTML reserves replaced; control characters become spaces.
std::string EscapeHtml(const std::string& text);

/// Round values between `low` and `high` for an axis, at most `count`.
std::vector<double> Ticks(double low, double high, int count);

}  // namespace morphbus::logger
