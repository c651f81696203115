#pragma once
// Which run a tool looks at (--run), and getting onto its bus.

#include <string>

#include "tools/cli.h"

namespace CLI {
class App;
}

namespace morphbus::tools {

struct RunChoice {
  std::string run;
  std::string lcm_url;
};

/// Adds --run and --lcm-url.
void AddRunChoice(CLI::App* sub, RunChoice* choice);

/// Finds the run (without --run: the only one, if there is just one; else the plain bus), joins its
/// private network if it has one, and returns the LCM URL to use. Call before any thread is
/// started.
Result<std::string> JoinRun(const RunChoice& choice);

}  // namespace morphbus::tools
