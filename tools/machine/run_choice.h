#pragma once
// Which run a tool looks at (--run), and getting onto its bus.

#include <string>

#include "compiler/base/result.h"
#include "tools/base/options.h"

namespace morphbus::tools {

/// What the user said of where to look, filled in when the command line is parsed.
struct RunChoice {
  std::string run;  ///< Name of a living run; empty: not said.
  /// LCM URL of the bus; empty: not said. It may name the bus of another host, where no run of this
  /// machine is.
  std::string lcm_url;
  /// File with the run's key, by which its messages are known; empty: that of a run here.
  std::string key_file = {};
};

/// Adds --run, --lcm-url and --key to a subcommand. `choice` must live until the command line is
/// parsed.
void AddRunChoice(Subcommand* sub, RunChoice* choice);

/// Finds the run, joins its private network if it has one, and returns the LCM URL to use. Without
/// --run that is the bus that --lcm-url names, else the only run here, else (there is none) LCM's
/// default bus. Fails if there are several. Call before any thread is started.
Result<std::string> JoinRun(const RunChoice& choice);

}  // namespace morphbus::tools
