#pragma once
// Tasks of a role: startups first, as one task; then behaviors, which repeat; commands and handlers
// as they come. Each task has its own stack; they run in turn, from wait to wait, within a budget.

#include "vm/role/module_services.h"
#include "vm/run/context.h"

namespace morphbus::vm {

/// Prepares the startups of the role just taken.
void StartRole(Context& context);

/// Ends all tasks and forgets what was queued.
void EndTasks(Context& context);

/// Runs whatever is due in this tick.
void RunTasks(Context& context, ModuleServices& services);

/// Lists the tasks for the status, and says which of the role have ended for good.
void FillTasks(const Context& context, StatusReport* status);

}  // namespace morphbus::vm
