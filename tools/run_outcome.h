#pragma once
// How a run went: what its processes said, and what its log holds.

#include <optional>
#include <string>

#include "logger/run_facts.h"
#include "tools/health_sender.h"
#include "tools/run_plan.h"

namespace morphbus::tools {

struct RunOutcome {
  std::string run;
  std::string log;     ///< Path, or where a cut log lies; empty if there is none.
  std::string error;   ///< Empty if the run ended well; names the process concerned.
  std::string reason;  ///< Why it ended, if not after --seconds.
  std::string hash;    ///< 32 hexadecimal digits; empty if it did not get that far.
  int64_t ticks = 0;
  int64_t messages = 0;  ///< Distinct, on hashed channels.
  int64_t missed_deadlines = 0;
  double wall_seconds = 0.0;  ///< From the first tick to the end.
  HealthTable health;         ///< Last of each process.
};

/// The object of `run --json` (docs/cli.md), from the outcome and the run's log.
Json SummaryJson(const RunPlan& plan, const RunOutcome& outcome);

/// One of its "faults". `file`, the program's, and `line` are null for a fault without a place in
/// the source, as of a module that ran nothing; so is `function` where there is none.
Json FaultJson(const logger::FaultFact& fault, const std::string& program);
/// The same on one line for people; without what is null.
std::string FaultText(const Json& fault);

/// The summary for people, many lines.
std::string SummaryText(const Json& summary, const RunOutcome& outcome);

}  // namespace morphbus::tools
