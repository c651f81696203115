#pragma once
// A whole run in one process, on the in-process bus and in virtual time: the same messages, and so
// the same hash, as with one process a module.

#include <string>

#include "tools/launch/run_outcome.h"

namespace morphbus::tools {

/// Runs `plan` in this thread until it is over, and writes its log to the path `log`. A signal ends
/// the run cleanly. What went wrong stands in the outcome's `error`; nothing is printed but
/// progress.
RunOutcome RunInProcess(const RunPlan& plan, const std::string& log);

}  // namespace morphbus::tools
