#pragma once
// Bars over sim time as inline SVG: which module had which role when, which foot stood when.

#include <string>
#include <vector>

#include "logger/show/drawing.h"
#include "logger/show/svg_plot.h"

namespace morphbus::logger {

/// A stretch of time in a row.
struct TimelineBar {
  /// Sim time, seconds.
  double begin = 0.0;
  double end = 0.0;
  Color color;
  /// What it stands for; written in the bar where there is room, and shown by browsers on hovering.
  std::string text;
};

/// One row, with its name at the left.
struct TimelineRow {
  std::string name;
  std::vector<TimelineBar> bars;
  /// Moments in the row, marked by a dot in the color of errors; the names are shown on hovering.
  std::vector<PlotMark> marks;
};

/// The rows below each other over one axis of time, from `begin` to `end` (s).
std::string TimelineSvg(const std::vector<TimelineRow>& rows, const std::string& title,
                        double begin, double end);

}  // namespace morphbus::logger
