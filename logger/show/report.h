#pragma once
// A comparison as one HTML page: no scripts, no external resources, light or dark as the reader's
// system is.

#include <string>

#include "logger/compare/comparer.h"
#include "logger/log/run_log.h"

namespace morphbus::logger {

/// The page, as the bytes of an HTML file. `a` and `b` are the logs that `comparison` was made of,
/// read with their series. Without models there are no tables and plots, but verdict and notes.
/// Texts from the logs are escaped, so that a hostile log cannot put markup into the page.
std::string ReportHtml(const RunLog& a, const RunLog& b, const Comparison& comparison);

}  // namespace morphbus::logger
