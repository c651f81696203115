#pragma once
// A run, and a comparison of two, each as one HTML page: no scripts, no external resources, light
// or dark as the reader's system is. Texts from the logs are escaped, so that a hostile log cannot
// put markup into the page.

#include <string>

#include "logger/compare/comparer.h"
#include "logger/log/run_log.h"

namespace morphbus::logger {

/// The page, as the bytes of an HTML file, of a log that was read with its series: where the robot
/// went, pictures of it at key moments, roles and faults over time, the gait, and every joint under
/// its convention. Without a model there is only what the log says of itself.
std::string RunReportHtml(const RunLog& log);

/// The same of a comparison. `a` and `b` are the logs that it was made of, read with their series.
/// Without models there are no tables and plots, but verdict and notes.
std::string ReportHtml(const RunLog& a, const RunLog& b, const Comparison& comparison);

}  // namespace morphbus::logger
