#pragma once
// A logged run once more, from what its log says of it alone.

#include <string>

#include "compiler/base/result.h"
#include "logger/log/run_log.h"
#include "tools/plan/run_plan.h"

namespace morphbus::tools {

/// The plan by which the logged run can be done again: its description, with the commands that
/// people gave at their ticks, the programs that they deployed, and the same end. What befell
/// messages on purpose is in it, though it changes none of them. The run's name is empty, for the
/// caller to choose; loaded without series is enough. Fails, in a sentence that says what is
/// missing, if the log cannot tell: it lacks the description, a deployed program or every tick, or
/// the run was in real time, where what happens depends on the wall clock.
Result<RunPlan> PlanAgain(const logger::RunLog& log);

}  // namespace morphbus::tools
