#pragma once
// Line plots as inline SVG for self-contained pages, which are read without a script, printed and
// searched (docs/libraries.md). Colours are CSS classes, so that a page decides them, light or
// dark.

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace morphbus::logger {

/// One line of a plot, and how it is named and styled.
struct PlotLine {
  /// What the legend calls it; empty to leave it out of the legend.
  std::string name;
  /// Class by which the page's style sheet gives it color and width, e.g. "line-a".
  std::string css_class;
  /// (x, y) in the units of the axes, in order of x if it is drawn over time. The line is broken
  /// where a value is not finite.
  std::vector<std::pair<double, double>> points;
};

/// A dashed line across the plot at one x, with a name at its upper end. One that lies outside what
/// the lines cover is not drawn; of names that would cover each other at most three are written,
/// below each other.
struct PlotMark {
  double x = 0.0;
  std::string name;
};

/// What a plot shows besides its lines.
struct PlotOptions {
  std::string title = {};
  /// Names of the axes, with their units.
  std::string x_label = {};
  std::string y_label = {};
  /// Size of the picture in the units of its view box; the page scales it to the room it has.
  int width = 640;
  int height = 240;
  /// True for a map: one metre is as long along y as along x.
  bool equal_axes = false;
  /// Least range of the y axis, so that noise is not blown up to fill the plot.
  double least_y_span = 0;
  std::vector<PlotMark> marks = {};
};

/// The plot as an <svg> element, whose texts are escaped. Lines are thinned to what the picture can
/// show (first, lowest, highest and last point of each of 600 columns are kept, and breaks). A plot
/// without any finite point says that there is nothing to show.
std::string PlotSvg(const std::vector<PlotLine>& lines, const PlotOptions& options);

/// Text with the five characters that HTML reserves replaced; control characters become spaces.
std::string EscapeHtml(const std::string& text);

/// Round values from `low` to `high` for an axis, 1, 2 or 5 times a power of ten apart: about
/// `count` of them, and never more than one above that. None if the range is empty or not finite.
std::vector<double> Ticks(double low, double high, int count);

}  // namespace morphbus::logger
