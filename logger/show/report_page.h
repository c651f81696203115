#pragma once
// What the pages of one run and of two have in common: no scripts, no external resources, light or
// dark as the reader's system is.

#include <string>
#include <utility>
#include <vector>

#include "logger/compare/kinematic_tracks.h"
#include "logger/log/text_lines.h"
#include "logger/show/svg_plot.h"

namespace morphbus::logger {

/// A table up to its first row. A column is called "name"; "#name" is one of numbers, which stand
/// to the right, and "#name|unit" has its unit below the name, small. `kind` is a class of its own.
std::string TableHead(const std::vector<std::string>& columns, const std::string& kind = "");
/// What closes it.
inline constexpr const char* kTableEnd = "</tbody></table></div>";

/// Points of a plot, in the units of its axes.
using PlotPoints = std::vector<std::pair<double, double>>;
/// (time, value) pairs: sim time in seconds, values times `scale` in the plot's unit.
PlotPoints Over(const ScalarTrack& track, double scale);

/// A page that is built piece by piece, from top to bottom: each function appends to html_.
class ReportPage {
 protected:
  /// Everything up to the heading; both are text. `style` follows the style of all pages.
  void Begin(const std::string& title, const std::string& heading, const char* style = "");
  /// Closes the page, and hands it out.
  std::string End();
  /// A line of a list of facts; one without a value is left out, as of a log without a description.
  void Fact(const char* name, const std::string& value);
  // What ran, how much of it the log holds, and who recorded it when.
  void RunFacts(const RunLog& log);
  void MessageFact(const LogFacts& facts);
  void BuildFacts(const LogFacts& facts);
  /// What a reader must know before believing the rest; nothing without notes.
  void Notes(const std::vector<std::string>& notes);
  /// A plot in a frame of its own.
  void Figure(const std::vector<PlotLine>& lines, const PlotOptions& options);
  /// Options of a plot over sim time, 640 px wide, with marks_; `height` in px, `least` the
  /// smallest span of its values (`unit`).
  [[nodiscard]] PlotOptions OverTime(std::string title, const char* unit, int height,
                                     double least) const;

  std::string html_;
  /// What happened when, for plots over sim time (s).
  std::vector<PlotMark> marks_;
};

}  // namespace morphbus::logger
