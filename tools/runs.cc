// morphbus runs: what runs on this machine.

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "tools/commands.h"
#include "tools/run_registry.h"

namespace morphbus::tools {
namespace {

int Runs(bool json) {
  const Result<std::vector<RunEntry>> runs = ListRuns();
  if (!runs) return Unusable(runs.error().message);
  if (json) {
    Json list = Json::array();
    for (const RunEntry& run : *runs) {
      list.push_back({{"run", run.name},
                      {"pid", run.pid},
                      {"since", run.since},
                      {"robot", run.robot},
                      {"alive", true},
                      {"isolated", run.isolated},
                      {"log", run.log}});
    }
    PrintJson({{"runs", list}});
    return kDone;
  }
  if (runs->empty()) {
    fmt::print("nothing runs here\n");
    return kDone;
  }
  fmt::print("{:<24} {:>8}  {:<25} {:<24} {:<9} {}\n", "run", "pid", "since", "robot", "network",
             "log");
  for (const RunEntry& run : *runs) {
    fmt::print("{:<24} {:>8}  {:<25} {:<24} {:<9} {}\n", run.name, run.pid, run.since, run.robot,
               run.url.empty() ? "in-process" : (run.isolated ? "private" : "shared"), run.log);
  }
  return kDone;
}

}  // namespace

void AddRuns(CLI::App& app, Action* action) {
  CLI::App* sub = app.add_subcommand("runs", "List what runs on this machine");
  auto json = std::make_shared<bool>(false);
  sub->add_flag("--json", *json, "One JSON object on stdout");
  sub->footer("Example:\n  morphbus runs");
  sub->callback([json, action] { *action = [json] { return Runs(*json); }; });
}

}  // namespace morphbus::tools
