#include "bridge/lockstep/sequence_tracker.h"

#include <algorithm>

namespace morphbus::bridge {

void MissingNumbers::Add(int64_t first, int64_t end) {
  for (int64_t number = std::max(first, end - kMost); number < end; ++number) {
    numbers_.insert(numbers_.end(), number);
  }
  while (numbers_.size() > static_cast<size_t>(kMost)) numbers_.erase(numbers_.begin());
}

SequenceTracker::Kind SequenceTracker::Take(int64_t sequence, Ledger* ledger) {
  constexpr int64_t kJustBefore = 64;
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
