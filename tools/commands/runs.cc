// morphbus runs: what runs on this machine.

#include <fmt/format.h>

#include "compiler/base/columns.h"
#include "tools/base/print.h"
#include "tools/commands/commands.h"
#include "tools/machine/run_registry.h"

namespace morphbus::tools {
namespace {

/// Where a run's messages are: "in one process", "private" or "shared".
const char* NetworkOf(const RunEntry& run) {
  // A run without a URL is in one process and has no bus.
  if (run.url.empty()) return "in one process";
  return run.isolated ? "private" : "shared";
}

/// All living runs. Listing them cleans up after dead ones.
int Runs(bool json) {
  // Runs of other users have registries of their own and are not seen.
  const Result<std::vector<RunEntry>> runs = ListRuns();
  if (!runs) return Unusable(runs.error().message);
  if (json) {
    // Only living runs are listed; "alive" is for scripts that expect it.
    Json list = Json::array();
    for (const RunEntry& run : *runs) {
      list.push_back({{"run", run.name},
                      {"pid", run.pid},
                      {"since", run.since},
                      {"robot", run.robot},
                      {"alive", true},
                      {"network", NetworkOf(run)},
                      {"isolated", run.isolated},
                      {"log", run.log.empty() ? Json(nullptr) : Json(run.log)}});
    }
    PrintJson({{"runs", list}});
    return kDone;
  }
  // For people; an empty list is an answer too.
  if (runs->empty()) {
    Print("nothing runs here\n");
    return kDone;
  }
  std::vector<std::vector<std::string>> rows = {{"run", "pid", "since", "robot", "network", "log"}};
  bool alone = false;
  for (const RunEntry& run : *runs) {
    rows.push_back({run.name, std::to_string(run.pid), run.since, run.robot, NetworkOf(run),
                    run.log.empty() ? "none" : run.log});
    alone = alone || run.url.empty();
  }
  PrintText(Columns(rows));
  if (alone) {
    Print(
        "a run in one process (--inproc) has no bus: spy, monitor and control cannot join it, and "
        "Ctrl-C or kill -INT of its process ends it\n");
  }
  return kDone;
}

}  // namespace

void AddRuns(CommandLine* line) {
  Subcommand sub = line->Add("runs", "List what runs on this machine");
  auto json = std::make_shared<bool>(false);
  sub.Json(json.get());
  sub.Footer("Example:\n  morphbus runs");
  sub.Do([json] { return Runs(*json); });
}

}  // namespace morphbus::tools
