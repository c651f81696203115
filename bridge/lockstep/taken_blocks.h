#pragma once
// What a process took lately, and what the logger recorded lately, so that a difference shows while
// the run goes on. Ticks are counted in blocks; whoever takes messages tells the logger their sum
// over a block (KIND_TAKEN) at its end, at the ends of the next two, and with each HEALTH.

#include <array>
#include <cstdint>
#include <optional>

#include "bridge/lockstep/run_totals.h"

namespace morphbus::bridge {

/// Ticks whose messages are summed up together.
inline constexpr int64_t kBlockTicks = 32;

/// How many blocks are told of: the present one, and those before it, since the logger may have
/// lacked some of them when they were told of first.
inline constexpr int64_t kToldBlocks = 3;

/// Sums over the last blocks, for one channel. Plain bytes: part of a snapshot.
class TakenBlocks {
 public:
  /// A message was taken at this tick; ticks never fall.
  void Add(int64_t tick, uint64_t digest) {
    Block& block = blocks_[static_cast<size_t>(tick / kBlockTicks) % blocks_.size()];
    const int64_t first = tick - tick % kBlockTicks;
    if (block.first != first) block = {first, {}};
    block.sum.Add(digest);
  }
  /// What was taken in the block that begins at this tick; nothing of one that is long over.
  [[nodiscard]] TakenSum Of(int64_t first) const {
    const Block& block = blocks_[static_cast<size_t>(first / kBlockTicks) % blocks_.size()];
    return block.first == first ? block.sum : TakenSum();
  }

 private:
  /// One block, by its first tick; -1: none yet.
  struct Block {
    int64_t first = -1;
    TakenSum sum;
  };
  std::array<Block, kToldBlocks> blocks_;
};

/// The last messages of a channel that has one a tick, as the logger took them.
class RecentDigests {
 public:
  /// The first message of this tick that was taken.
  void Add(int64_t tick, uint64_t digest) {
    Entry& entry = entries_[static_cast<size_t>(tick) % entries_.size()];
    if (entry.tick < tick) entry = {tick, digest};
  }
  /// Has the processor fetch what this tick needs. Nothing else changes.
  void Fetch(int64_t tick) const {
    __builtin_prefetch(&entries_[static_cast<size_t>(tick) % entries_.size()]);
  }
  /// The sum, modulo 2^64, over all ticks from `first` to `last`; nothing unless all are there.
  [[nodiscard]] std::optional<uint64_t> Sum(int64_t first, int64_t last) const {
    uint64_t sum = 0;
    for (int64_t tick = first; tick <= last; ++tick) {
      const Entry& entry = entries_[static_cast<size_t>(tick) % entries_.size()];
      if (entry.tick != tick) return std::nullopt;
      sum += entry.digest;
    }
    return sum;
  }

 private:
  /// XXH3 of the message of a tick; -1: none.
  struct Entry {
    int64_t tick = -1;
    uint64_t digest = 0;
  };
  /// A block more than is told of, since a process may be a window behind the logger, and the
  /// logger behind it.
  std::array<Entry, (kToldBlocks + 1) * kBlockTicks> entries_;
};

}  // namespace morphbus::bridge
