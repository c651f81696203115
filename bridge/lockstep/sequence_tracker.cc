#include "bridge/lockstep/sequence_tracker.h"

#include <algorithm>

namespace morphbus::bridge {

void MissingNumbers::Add(int64_t first, int64_t end) {
  for (int64_t number = std::max(first, end - kMost); number < end; ++number) {
    numbers_.insert(numbers_.end(), number);
  }
  while (numbers_.size() > static_cast<size_t>(kMost)) numbers_.erase(numbers_.begin());
}

void SequenceTracker::Remember(size_t numbers) {
  if (numbers > seen_.size()) seen_.resize(numbers);
}

bool SequenceTracker::Note(int64_t sequence, uint64_t digest) {
  Seen& seen = seen_[static_cast<size_t>(sequence) % seen_.size()];
  if (seen.sequence == sequence) return seen.digest == digest;
  // A number that is older than what stands in its place is too old to be compared.
  if (seen.sequence < sequence) seen = {sequence, digest};
  return true;
}

SequenceTracker::Kind SequenceTracker::Take(int64_t sequence, uint64_t digest, Ledger* ledger) {
  constexpr int64_t kJustBefore = 64;
  if (!Note(sequence, digest)) return Kind::kConflict;
  if (highest_ < 0) {
    highest_ = sequence;
    // Whatever came before we listened is not ours to miss, but may still arrive.
    missing_.Add(std::max<int64_t>(0, sequence - kJustBefore), sequence);
    return Kind::kNext;
  }
  // Everything between the last number and this one is missing, perhaps for a while only.
  if (sequence > highest_) {
    const int64_t gap = sequence - highest_ - 1;
    ledger->lost += gap;
    missing_.Add(highest_ + 1, sequence);
    highest_ = sequence;
    return gap == 0 ? Kind::kNext : Kind::kAfterGap;
  }
  // An older number either fills a gap that is remembered or is a repetition.
  if (missing_.Fill(sequence)) return Kind::kLate;
  ++ledger->duplicates;
  return Kind::kDuplicate;
}

}  // namespace morphbus::bridge
