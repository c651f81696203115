#pragma once
// One run as one HTML page: no scripts, no external resources, light or dark as the reader's system
// is.

#include <string>

#include "logger/log/run_log.h"

namespace morphbus::logger {

/// The page, as the bytes of an HTML file, of a log that was read with its series: where the robot
/// went, pictures of it at key moments, roles and faults over time, the gait, and every joint under
/// its convention. Without a model there is only what the log says of itself. Texts from the log
/// are escaped.
std::string RunReportHtml(const RunLog& log);

}  // namespace morphbus::logger
