#include "bridge/lockstep/sequence_tracker.h"

namespace morphbus::bridge {

SequenceTracker::Kind SequenceTracker::Take(int64_t sequence, Ledger* ledger) {
  constexpr int64_t kMemory = 64;
  if (highest_ < 0) {
    highest_ = sequence;
    // Whatever came before we listened is not ours to miss, but may still arrive.
    seen_ = 1;
    return Kind::kNext;
  }
  // Everything between the last number and this one is missing, perhaps for a while only.
  if (sequence > highest_) {
    const int64_t step = sequence - highest_;
    ledger->lost += step - 1;
    seen_ = (step >= kMemory ? 0 : seen_ << step) | 1;
    highest_ = sequence;
    return step == 1 ? Kind::kNext : Kind::kAfterGap;
  }
  // An older number either fills a gap that is remembered or is a repetition.
  const int64_t age = highest_ - sequence;
  if (age < kMemory && (seen_ >> age & 1) == 0) {
    seen_ |= uint64_t{1} << age;
    return Kind::kLate;
  }
  ++ledger->duplicates;
  return Kind::kDuplicate;
}

}  // namespace morphbus::bridge
