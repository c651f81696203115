#pragma once
// Gaps, repeats and contradictions in the sequence numbers of what arrives.

#include <cstdint>
#include <set>
#include <vector>

#include "bridge/wire/health.h"

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
  /// one that came before with the same bytes (or so long ago that nobody knows), or one that came
  /// before with others.
  enum class Kind : uint8_t { kNext, kAfterGap, kLate, kDuplicate, kConflict };
  /// Takes a number, with a hash of the bytes that stand under it (MessageDigest); counts gaps into
  /// `ledger->lost` and repeats into `ledger->duplicates`. Of a number with other bytes than those
  /// that came first nothing is counted here. The first number ever taken opens the row, whatever
  /// it is; the caller makes sure that no number is far ahead.
  Kind Take(int64_t sequence, uint64_t digest, Ledger* ledger);

  /// Has the processor fetch what the next number needs. Nothing else changes.
  void FetchNext() const {
    __builtin_prefetch(&seen_[static_cast<size_t>(highest_ + 1) % seen_.size()]);
  }

  /// Remembers the bytes of so many of the last numbers; 64 before it is called.
  void Remember(size_t numbers);

 private:
  /// A number that was taken, and the hash of its bytes.
  struct Seen {
    int64_t sequence = -1;
    uint64_t digest = 0;
  };
  /// Notes the bytes of a number. Returns false if others are known.
  bool Note(int64_t sequence, uint64_t digest);

  /// The highest number taken; -1 before the first one.
  int64_t highest_ = -1;
  MissingNumbers missing_;  ///< Below it.
  /// The last numbers, each at the place that is its remainder.
  std::vector<Seen> seen_ = std::vector<Seen>(64);
};

}  // namespace morphbus::bridge
