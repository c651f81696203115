#pragma once
// The commands that people gave to two runs, side by side.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "logger/log/run_facts.h"

namespace morphbus::logger {

/// A command of one run or of both.
struct CommandPair {
  /// As `run --commands` reads it.
  std::string text;
  /// The ticks in which it took effect in A and in B; one is missing if only the other run had it.
  std::optional<int64_t> tick_a, tick_b;
};

/// So many commands of each log are paired; a run with more has them from a machine, and `info`
/// lists all.
constexpr size_t kMostPairedCommands = 1000;

/// Pairs equal commands in their order: as many as can be of the same tick, then as many as can be
/// of other ticks (longest common subsequence). All stand in the order of both logs.
std::vector<CommandPair> PairCommands(const LogFacts& a, const LogFacts& b);

/// Whether the runs had different commands there. `by_ticks` says that equal commands must have
/// equal ticks, too, as in runs that are compared tick for tick.
bool Differs(const CommandPair& pair, bool by_ticks);

/// Where the commands of two runs differ first, and how many do, in a sentence; empty if none does.
std::string CommandsNote(const std::vector<CommandPair>& pairs, bool by_ticks);

}  // namespace morphbus::logger
