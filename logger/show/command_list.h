#pragma once
// The commands that people gave to a run, on its page: a table, and marks on plots over sim time.

#include <string>
#include <vector>

#include "logger/compare/comparer.h"
#include "logger/show/svg_plot.h"

namespace morphbus::logger {

/// A section with the commands of one run, and the deployments' tilts. Empty without any.
std::string CommandsHtml(const LogFacts& facts);
/// A section with those of two runs beside each other. Empty without any.
std::string CommandsHtml(const Comparison& comparison);

/// Marks for what was done to the robot or its program, named by the command's first word. What
/// only held or paced the run leaves no mark: sim time does not know of it.
std::vector<PlotMark> CommandMarks(const LogFacts& facts);
/// The same for two runs, on the time line of A: a command that only one had is marked with its
/// name; those of B alone are left out where B's times were brought onto A's.
std::vector<PlotMark> CommandMarks(const Comparison& comparison);

}  // namespace morphbus::logger
