#pragma once
// Gaps and repeats in the sequence numbers of what arrives.

#include <cstdint>
#include <map>
#include <string>

#include "bridge/bus.h"

namespace morphbus::bridge {

/// One sender's numbers on one channel. Remembers the last 64: what comes later than that and is
/// older counts as a duplicate.
class SequenceTracker {
 public:
  enum class Kind : uint8_t { kNext, kAfterGap, kLate, kDuplicate };
  /// Takes a number; counts gaps into `ledger->lost` and repeats into `ledger->duplicates`. The
  /// first number ever taken opens the row, whatever it is.
  Kind Take(int64_t sequence, Ledger* ledger);

 private:
  int64_t highest_ = -1;
  uint64_t seen_ = 0;  ///< Bit i: highest_ - i was taken.
};

/// By channel.
using SequenceTrackers = std::map<std::string, SequenceTracker, std::less<>>;

}  // namespace morphbus::bridge
