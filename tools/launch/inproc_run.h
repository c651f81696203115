#pragma once
// A whole run in one process, on the in-process bus and in virtual time: the same messages, and so
// the same hash, as with one process a module.

#include "bridge/wire/run_key.h"
#include "tools/launch/run_outcome.h"
#include "tools/launch/run_record.h"

namespace morphbus::tools {

/// Runs `plan` with this key in this thread until it is over, and records it. A signal ends the run
/// cleanly. What went wrong stands in the outcome's `error`; nothing is printed but progress.
RunOutcome RunInProcess(const RunPlan& plan, const RunRecord& record, const bridge::RunKey& key);

}  // namespace morphbus::tools
