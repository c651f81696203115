#pragma once
// A run of this machine that can be commanded, found by its name.

#include <cstdint>
#include <string>

#include "bridge/wire/run_key.h"
#include "compiler/base/result.h"
#include "tools/machine/run_registry.h"
#include "tools/plan/run_plan.h"

namespace morphbus::tools {

/// So long a run may take to answer a command, microseconds of wall time.
inline constexpr int64_t kControlPatienceUs = 5'000'000;

/// What is known of the run, and what is needed to command it.
struct ControlledRun {
  RunEntry entry;
  bridge::RunKey key;
  RunPlan plan;
};

/// The run of this name, or the only one if it is empty. Fails unless it can be commanded: runs in
/// one process and replays take no commands.
Result<ControlledRun> FindControlled(const std::string& name);

}  // namespace morphbus::tools
