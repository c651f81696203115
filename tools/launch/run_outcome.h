#pragma once
// How a run went: what its processes said, and what its log holds.

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "logger/figures/run_figures.h"
#include "logger/log/run_facts.h"
#include "tools/base/json.h"
#include "tools/plan/run_plan.h"

namespace morphbus::tools {

/// How a run went for its processes. The launcher or the in-process run makes one, from what the
/// processes report; what was said in the run stands in its log alone (RunSummary).
struct RunOutcome {
  /// The run's name.
  std::string run;
  std::string log;    ///< Path, or where a cut log lies; empty if there is none.
  std::string error;  ///< Empty if the run ended well; names the process concerned.
  /// The run's hash as the logger computed it from what it heard; empty if it did not close the
  /// log.
  std::string hash;
  std::string reason;  ///< Why it ended, if not after --seconds.
  int64_t ticks = 0;   ///< So far, for the progress shown.
  /// In a real-time run the answers that had not come when their tick was over, as the simulator
  /// counts them; 0 in lockstep.
  int64_t missed_deadlines = 0;
  /// Modules whose processes died and were started again, and how often.
  std::map<std::string, int> restarts;
  double wall_seconds = 0.0;  ///< From the first tick to the end.
};

/// What there is to say of a run. What was said and lost, its hash, roles and faults are those of
/// its log, which `info` reads in the same way; the outcome adds how it went for the processes.
struct RunSummary {
  RunOutcome outcome;
  logger::LogFacts facts;  ///< Of the log; empty if there is none that can be read.
  /// The run's hash: the outcome's or, without one, that of what the log holds. Where the log was
  /// altered while it was written, the two differ.
  std::string hash;
  /// Of the program image, and of the simulated world and the machine's arithmetic as hexadecimal
  /// text: as the description has them.
  uint64_t program_hash = 0;
  std::string world_hash, arithmetic;
  int64_t messages = 0;  ///< Distinct, on hashed channels.
  int64_t lost = 0;      ///< Over all processes, on purpose or not.
  /// Messages that were sent again because somebody asked for them, over all processes.
  int64_t resent = 0;
  /// Messages that were refused because nobody of the run can have sent them, over all processes.
  int64_t refused = 0;
  std::vector<std::pair<std::string, std::string>> roles;  ///< Module, its last role (or empty).
  /// Why modules have no role at the end: for each the first thing that fails in every role, as
  /// `morphbus roles` finds it for the robot at its start values. Empty for a program without
  /// roles.
  std::vector<std::string> problems;
  /// What modules told of themselves because a command had asked them (InspectionsOf).
  Json inspections = Json::array();
  /// Where the robot went, and its gait.
  logger::RunFigures figures;
};

/// Reads the run's log and adds what it holds to `outcome`. `plan` is the plan that was run. Where
/// the log cannot be read, the summary holds the outcome and the hashes alone. A log that cannot be
/// read back, or that does not hold what was recorded, is an error of the outcome.
RunSummary Summarize(const RunPlan& plan, RunOutcome outcome);
/// The object of `run --json` (docs/cli.md).
Json SummaryJson(const RunSummary& summary);
/// The summary for people, many lines, with a line feed at the end of each.
std::string SummaryText(const RunSummary& summary);

/// A fault that a module reported, as one of the "faults" of `run --json`. `file`, the program's,
/// and `line` are null for a fault without a place in the source, as of a module that ran nothing;
/// so is `function` where there is none.
Json FaultJson(const logger::FaultFact& fault);
/// The same on one line for people.
std::string FaultText(const logger::FaultFact& fault);

}  // namespace morphbus::tools
