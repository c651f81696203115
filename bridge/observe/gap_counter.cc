#include "bridge/observe/gap_counter.h"

#include <algorithm>

namespace morphbus::bridge {

bool GapCounter::Take(int64_t sequence) {
  if (sequence < 0) return false;
  // The first number opens the row, whatever it is.
  if (highest_ < 0) {
    highest_ = sequence;
    return true;
  }
  // One that was started again begins with numbers far above those of before.
  if (sequence - highest_ >= kFarAbove) missing_.reset(), highest_ = sequence - 1;
  if (sequence > highest_) {
    // Everything between is missing, perhaps for a while only; what is older is forgotten.
    below_ = 0;
    lost_ += sequence - highest_ - 1;
    if (sequence - highest_ >= kWindow) {
      missing_.set();
    } else {
      for (int64_t n = highest_ + 1; n < sequence; ++n)
        missing_.set(static_cast<size_t>(n % kWindow));
    }
    missing_.reset(static_cast<size_t>(sequence % kWindow));
    highest_ = sequence;
    return true;
  }
  if (sequence > highest_ - kWindow) {
    below_ = 0;
    // Within the window it is known of each number whether it is missing.
    const auto place = static_cast<size_t>(sequence % kWindow);
    const bool filled = missing_.test(place) && lost_ > 0;
    missing_.reset(place);
    lost_ -= filled ? 1 : 0;
    return filled;
  }
  // Far below: an old message once more, or a sender that has begun anew, whose numbers grow.
  below_ = sequence > last_below_ ? below_ + 1 : 1;
  last_below_ = sequence;
  if (below_ < kNewBeginning) return false;
  below_ = 0;
  highest_ = sequence;
  missing_.reset();
  return true;
}

}  // namespace morphbus::bridge
