#pragma once
// How a run ends: why, whether all went well, and what all channels carried.

#include <cstdint>
#include <functional>
#include <morphbus/totals_t.hpp>
#include <set>
#include <string>
#include <vector>

#include "bridge/lockstep/run_totals.h"
#include "bridge/wire/stream_hash.h"

namespace morphbus::bridge {

/// How a run ended, for the summary; read it once the participant is done.
struct SimOutcome {
  /// The run ended as planned, everybody acknowledged it, and the hashes agree.
  bool ok = false;
  std::string error;   ///< Empty if ok; names the process concerned.
  std::string reason;  ///< As in CLOCK's end_reason.
  /// Ticks that were computed to their end.
  int64_t ticks = 0;
  std::string run_hash;       ///< 32 hexadecimal digits; empty if a module did not acknowledge END.
  std::string recorded_hash;  ///< The logger's; empty without one.
  /// Counts and hashes of all hashed channels, in order of name.
  std::vector<ChannelTotal> totals;
  int64_t messages = 0;  ///< Distinct messages on hashed channels.
  /// Real time: commands that came too late.
  int64_t missed_deadlines = 0;
};

/// Gathers what says how a run ended: who asked for it, what went wrong, and what all members tell
/// of their channels.
class RunEnding {
 public:
  /// What is known of the run besides, at any moment.
  struct Facts {
    int64_t ticks = 0;                             ///< Computed to their end.
    int64_t missed_deadlines = 0;                  ///< As in SimOutcome.
    std::vector<std::string> silent;               ///< Members that kept silent too long.
    std::vector<std::string> gone;                 ///< Modules that the run went on without.
    bool all_acknowledged = false;                 ///< Every module has acknowledged END.
    std::set<std::string, std::less<>> unvouched;  ///< As in RunMembers.
  };

  /// @param num_modules  how many members are modules; if there is a `logger`, it is the next one.
  /// @param planned      the reason when the last tick is over and nothing is wrong; empty:
  ///                     "finished".
  RunEnding(int num_modules, bool logger, bool realtime, std::string planned);

  /// The run is to end after the current tick. The first reason is the one that it ended for.
  void AskFor(const std::string& reason);
  /// The run cannot go on. The first refusal is the one to report.
  void Refuse(const std::string& why);
  /// Why the run cannot go on, as a sentence; empty while all is well.
  [[nodiscard]] const std::string& refusal() const { return refusal_; }
  /// What CLOCK says at the end. It tells what is known now; the verdict for the logger may know
  /// more.
  const std::string& ChooseReason(const Facts& facts);

  /// Takes a part of what a member (by number) tells of its channels. True if that is all of it.
  bool Take(int member, const morphbus::totals_t& part) { return told_[member].Take(part); }
  /// Works out how the run ended, as far as is known now.
  /// @param own  what the simulator itself has published.
  void Conclude(const Facts& facts, std::vector<ChannelTotal> own);
  /// Complete once the run is over.
  [[nodiscard]] const SimOutcome& outcome() const { return outcome_; }

 private:
  /// Why the run failed, as far as it is not the log's content: a refusal, or who kept silent, as a
  /// sentence; empty while all is well.
  [[nodiscard]] std::string Wrong(const Facts& facts) const;

  int num_modules_;
  bool logger_, realtime_;
  std::string planned_;
  std::string refusal_;
  std::vector<TotalsParts> told_;  ///< By member.
  SimOutcome outcome_;
};

}  // namespace morphbus::bridge
