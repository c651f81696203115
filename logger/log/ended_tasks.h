#pragma once
// Which tasks of a robot's program had ended for good when its run, or its log, ended.

#include <cstdint>
#include <map>
#include <morphbus/status_t.hpp>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "logger/log/program_facts.h"

namespace morphbus::logger {

/// Behaviors and startups that a fault has ended and that do not run again, over all modules.
struct EndedFacts {
  int64_t behaviors = 0;
  int64_t startups = 0;
  /// The faults that ended them, the earliest first. A module tells of a few faults a tick only, so
  /// there may be fewer than the counts say.
  std::vector<FaultFact> faults;
};

/// Follows by STATUS, message by message, which tasks of each module have ended. A role that is
/// taken anew, a new program and a cold start begin all tasks afresh.
class EndedTasks {
 public:
  /// Takes a module's STATUS; `reported` says what is common to all that it tells of.
  void Take(const ProgramFact& reported, const morphbus::status_t& status);
  /// What has ended by the last STATUS of each module but the lost ones, of which nothing is
  /// expected to run; by module, the sim time at which it was lost. The faults are not worded yet.
  [[nodiscard]] EndedFacts Facts(const std::map<std::string, int64_t>& lost) const;

 private:
  /// What a module's newest STATUS says.
  struct Module {
    int64_t tick = -1;
    int role = -1;
    int64_t program_hash = 0;
    int incarnation = 0;
    int behaviors = 0;
    bool startup = false;
    std::vector<FaultFact> faults;
  };
  std::map<std::string, Module> modules_;
};

/// A line for each kind of task of which some have ended: how many, and of the first ten module,
/// function and place, "2 behaviors have ended by a fault: m2, m3 Leg.walk (walk.dyn:7)".
std::vector<std::string> EndedLines(const EndedFacts& ended);

/// The kind of the task that a fault has ended; null if it has ended none.
nlohmann::json EndedKind(const FaultFact& fault);

/// The same for `run --json` and `info --json`: `behaviors` and `startups` are the counts, `tasks`
/// has of each `module`, `time` (s of sim time), `role`, `kind`, `function`, and the fault's `file`
/// and `line`, null where it has none.
nlohmann::json EndedJson(const EndedFacts& ended);

}  // namespace morphbus::logger
