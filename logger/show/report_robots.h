#pragma once
// The part of a comparison page that shows both robots side by side, and what differs physically.

#include <string>

#include "logger/compare/comparer.h"
#include "logger/log/run_log.h"

namespace morphbus::logger {

/// One section with both robots as they start and where they first diverge, modules coloured by
/// role, and a table of the connections that differ, numbered as in the pictures. Empty where a log
/// has no model or no simulated world. `b` is B with the times that the comparison has.
std::string RobotsHtml(const RunLog& a, const RunLog& b, const Comparison& comparison);

}  // namespace morphbus::logger
