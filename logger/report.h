#pragma once
// A comparison as one HTML page: no scripts, no external resources, light or dark as the reader's
// system is.

#include <string>

#include "logger/comparer.h"
#include "logger/run_log.h"

namespace morphbus::logger {

/// The page. `a` and `b` are the logs that `comparison` was made of.
std::string ReportHtml(const RunLog& a, const RunLog& b, const Comparison& comparison);

}  // namespace morphbus::logger
