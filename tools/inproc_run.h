#pragma once
// A whole run in one process, on the in-process bus and in virtual time: the same messages, and so
// the same hash, as with one process a module.

#include <string>

#include "tools/run_outcome.h"

namespace morphbus::tools {

/// Runs `plan` and writes `log`. A signal ends it cleanly.
RunOutcome RunInProcess(const RunPlan& plan, const std::string& log);

}  // namespace morphbus::tools
