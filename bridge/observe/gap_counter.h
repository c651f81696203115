#pragma once
// Messages that are missing, by the numbers that a sender gives those of a channel.

#include <bitset>
#include <cstdint>

namespace morphbus::bridge {

/// Counts what is missing on one channel, in fixed memory whatever numbers come: for listeners that
/// believe nobody. The run's own processes use bridge::SequenceTracker.
class GapCounter {
 public:
  /// Takes a number. Returns whether it is new: the next one, one beyond a gap, or one that was
  /// missing; false for one that came before, or so long ago that nobody knows.
  bool Take(int64_t sequence);
  /// Numbers that were passed over and have not come since.
  [[nodiscard]] int64_t lost() const { return lost_; }

 private:
  // Numbers that are remembered, and in a row below them that make a new beginning.
  static constexpr int64_t kWindow = 1024;
  static constexpr int kNewBeginning = 8;
  // A number so far above the highest is nobody's next one (Outbox::BeginAt).
  static constexpr int64_t kFarAbove = int64_t{1} << 31;

  /// The highest number so far; -1 before the first.
  int64_t highest_ = -1;
  /// Which of the last kWindow numbers are missing, each at the place that is its remainder.
  std::bitset<kWindow> missing_;
  int64_t lost_ = 0;
  /// A sender that was started anew counts from 0 again: how many numbers, each above the last,
  /// have come below the window, and the last of them.
  int below_ = 0;
  int64_t last_below_ = -1;
};

}  // namespace morphbus::bridge
