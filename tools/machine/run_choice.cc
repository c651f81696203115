#include "tools/machine/run_choice.h"

#include "tools/machine/key_choice.h"
#include "tools/machine/network.h"
#include "tools/machine/run_registry.h"

namespace morphbus::tools {

void AddRunChoice(Subcommand* sub, RunChoice* choice) {
  sub->Add("--run", &choice->run, "The run to look at (default: the only one; see morphbus runs)")
      .TypeName("RUN");
  sub->Add("-l,--lcm-url", &choice->lcm_url, "LCM URL (default: the run's, else $LCM_DEFAULT_URL)")
      .TypeName("URL");
  AddKeyFile(sub, &choice->key_file, "that of the run of this machine");
}

Result<std::string> JoinRun(const RunChoice& choice) {
  // A bus that is named is the one that is meant, whatever else runs here.
  if (choice.run.empty() && !choice.lcm_url.empty()) return choice.lcm_url;
  // Without a name this is the only run here.
  const Result<RunEntry> run = FindRun(choice.run);
  if (!run) {
    // Without a run of ours there may still be others on the bus: stock tools, other hosts.
    const Result<std::vector<RunEntry>> all = ListRuns();
    if (choice.run.empty() && all && all->empty()) return std::string();
    return Fail(run.error().message);
  }
  if (run->url.empty())
    return Fail("run " + run->name + " is in one process and has no bus to listen on");
  if (Result<void> joined = JoinNetworkOf(*run); !joined) return Fail(joined.error().message);
  // A URL beside --run is for a bus in the network of that run.
  return choice.lcm_url.empty() ? run->url : choice.lcm_url;
}

}  // namespace morphbus::tools
