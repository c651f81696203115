#pragma once
// Gaps and repeats in the sequence numbers of what arrives.

#include <cstdint>
#include <map>
#include <set>
#include <string>

#include "bridge/bus/bus.h"

namespace morphbus::bridge {

/// Numbers that were passed over and may still come. Only the highest are remembered, so that no
/// message can make this large.
class MissingNumbers {
 public:
  /// So many are remembered at most.
  static constexpr int64_t kMost = 1024;
  /// The numbers from `first` up to but without `end` are missing; all were so far unknown here,
  /// and none is below those of earlier calls.
  void Add(int64_t first, int64_t end);
  /// The number has come. Returns false if it was not missing, or has been forgotten.
  bool Fill(int64_t number) { return numbers_.erase(number) > 0; }

 private:
  std::set<int64_t> numbers_;
};

/// One sender's numbers on one channel. What fills a gap after more than MissingNumbers::kMost
/// others were missed counts as a duplicate. It only feeds the ledger; what is asked for again is
/// decided by the state machines.
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
  MissingNumbers missing_;  ///< Below it.
};

/// A tracker for each channel that a process listens to; by any name that tells them apart.
using SequenceTrackers = std::map<std::string, SequenceTracker, std::less<>>;

}  // namespace morphbus::bridge
