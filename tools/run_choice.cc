#include "tools/run_choice.h"

#include <CLI/CLI.hpp>

#include "tools/network.h"
#include "tools/run_registry.h"

namespace morphbus::tools {

void AddRunChoice(CLI::App* sub, RunChoice* choice) {
  sub->add_option("--run", choice->run,
                  "The run to look at (default: the only one; see morphbus runs)");
  sub->add_option("-l,--lcm-url", choice->lcm_url,
                  "LCM URL (default: the run's, else $LCM_DEFAULT_URL)");
}

Result<std::string> JoinRun(const RunChoice& choice) {
  const Result<RunEntry> run = FindRun(choice.run);
  if (!run) {
    // Without a run of ours there may still be others on the bus: stock tools, other hosts.
    const Result<std::vector<RunEntry>> all = ListRuns();
    if (choice.run.empty() && all && all->empty()) return choice.lcm_url;
    return Fail(run.error().message);
  }
  if (run->url.empty())
    return Fail("run " + run->name + " is in one process and has no bus to listen on");
  if (run->isolated) {
    if (Result<void> joined = JoinNetworkOf(run->pid); !joined) return Fail(joined.error().message);
  }
  return choice.lcm_url.empty() ? run->url : choice.lcm_url;
}

}  // namespace morphbus::tools
