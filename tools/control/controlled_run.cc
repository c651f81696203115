#include "tools/control/controlled_run.h"

#include <fmt/format.h>

#include <utility>

#include "tools/base/files.h"
#include "tools/machine/key_choice.h"

namespace morphbus::tools {

Result<ControlledRun> FindControlled(const std::string& name) {
  Result<RunEntry> entry = FindRun(name);
  if (!entry) return Fail(entry.error().message);
  if (entry->url.empty()) {
    return Fail(fmt::format("run {} is in one process and takes no commands", entry->name));
  }
  // Commands speak of the run's modules and ticks, which its description has. A replay has none:
  // there is no robot to command.
  const Result<std::string> description = ReadFile(entry->folder + "/description.pb");
  if (!description) return Fail(description.error().message);
  Result<RunPlan> plan = PlanFromDescription(*description);
  if (!plan) return Fail(plan.error().message);
  const Result<bridge::RunKey> key =
      plan->description.open() ? bridge::RunKey() : bridge::RunKey::Read(KeyPath(entry->folder));
  if (!key) return Fail(fmt::format("run {}: {}", entry->name, key.error().message));
  return ControlledRun{std::move(*entry), *key, std::move(*plan)};
}

}  // namespace morphbus::tools
