#pragma once
// Gaps and repeats in the sequence numbers of what arrives.

#include <cstdint>
#include <map>
#include <string>

#include "bridge/bus/bus.h"

namespace morphbus::bridge {

/// One sender's numbers on one channel. Remembers the last 64: what comes later than that and is
/// older counts as a duplicate. It only feeds the ledger; what is asked for again is decided by the
/// state machines.
class SequenceTracker {
 public:
  /// What a number was: the next one, one beyond a gap, one from within a gap that comes after all,
  /// or one that came before.
  enum class Kind : uint8_t { kNext, kAfterGap, kLate, kDuplicate };
  /// Takes a number; counts gaps into `ledger->lost` and repeats into `ledger->duplicates`. The
  /// first number ever taken opens the row, whatever it is.
  Kind Take(int64_t sequence, Ledger* ledger);

 private:
  /// The highest number taken; -1 before the first one.
  int64_t highest_ = -1;
  uint64_t seen_ = 0;  ///< Bit i: highest_ - i was taken.
};

/// A tracker for each channel that a process listens to; by any name that tells them apart.
using SequenceTrackers = std::map<std::string, SequenceTracker, std::less<>>;

}  // namespace morphbus::bridge
