#include "tools/launch/controlled_run.h"

#include <fmt/format.h>

#include <utility>

#include "tools/base/files.h"
#include "tools/launch/control_script.h"

namespace morphbus::tools {

Result<ControlledRun> FindControlled(const std::string& name) {
  Result<RunEntry> entry = FindRun(name);
  if (!entry) return Fail(entry.error().message);
  if (entry->url.empty()) {
    return Fail(fmt::format("run {} is in one process and takes no commands", entry->name));
  }
  // A replay has no key: there is no robot to command.
  const auto key = bridge::ReadControlKey(ControlKeyPath(entry->folder));
  if (!key) return Fail(fmt::format("run {}: {}", entry->name, key.error().message));
  // Commands speak of the run's modules and ticks, which its description has.
  const Result<std::string> description = ReadFile(entry->folder + "/description.pb");
  if (!description) return Fail(description.error().message);
  Result<RunPlan> plan = PlanFromDescription(*description);
  if (!plan) return Fail(plan.error().message);
  return ControlledRun{std::move(*entry), *key, std::move(*plan)};
}

}  // namespace morphbus::tools
