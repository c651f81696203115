#pragma once
// One channel's messages put into order of their sequence numbers: what is lost, what came twice,
// and the hash that the run's END event must agree with.

#include <cstdint>
#include <deque>
#include <map>
#include <span>
#include <utility>

#include "bridge/wire/stream_hash.h"

namespace morphbus::logger {

/// The messages of one channel of one run. The reader of logs makes one per channel, feeds it the
/// events in the order of the file, calls Finish(), and then asks for the totals; so does, in real
/// time, the recorder, whose END is thus about the same messages in the same order.
class ChannelStream {
 public:
  /// What a numbered message turned out to be: the first under its number; the same bytes again,
  /// which is harmless (a publisher resends what somebody lacked); or other bytes under a known
  /// number, which is damage that the caller reports.
  enum class Kind { kNew, kDuplicate, kConflict };

  /// Takes a message with sequence number `sequence`; numbers begin at 0. One that comes before its
  /// predecessors waits for them. A gap is given up, and counted as lost, once 4096 later messages
  /// wait, so memory stays bounded; what turns up after that counts as a duplicate, and so does a
  /// repetition whose first copy lies too far back to be compared with it.
  Kind Take(int64_t sequence, std::span<const uint8_t> payload);
  /// Takes a message of a channel without common numbering; hashed in the order of the file.
  void TakeUnnumbered(std::span<const uint8_t> payload);
  /// Widens the stretch of sim time (µs) that the channel covers by the time of one message.
  void TakeTime(int64_t time_us);
  /// Gives up all gaps and takes what still waits. Call it once, after the last message and before
  /// the getters below.
  void Finish();

  /// Distinct messages taken, lost ones not included.
  [[nodiscard]] int64_t count() const { return count_; }
  /// Messages that came again; they count neither as messages nor for the hash.
  [[nodiscard]] int64_t duplicates() const { return duplicates_; }
  /// Sequence numbers below the highest one taken that never came.
  [[nodiscard]] int64_t lost() const { return lost_; }
  /// The first number that is lost; -1 if none is.
  [[nodiscard]] int64_t first_lost() const { return first_lost_; }
  /// XXH3 (64 bits) over the payloads in order of their numbers, to be compared with END's.
  [[nodiscard]] uint64_t hash() const { return hash_.Digest(); }
  /// Sim time between the earliest and the latest message, in seconds; 0 if no time was noted.
  [[nodiscard]] double sim_seconds() const;

 private:
  /// Counts and hashes the message that comes next in order, by its payload's hash.
  void Append(int64_t sequence, uint64_t digest);
  /// Appends the waiting messages that are in order, and gives up gaps, the lowest first, while
  /// more than `keep` messages wait behind them.
  void Drain(size_t keep);

  // These are the totals, over what was taken in order.
  bridge::StreamHash hash_;
  int64_t count_ = 0, duplicates_ = 0, lost_ = 0, first_lost_ = -1;
  /// Every number below this one was taken or given up.
  int64_t next_ = 0;
  /// Hashes of payloads that came before their predecessors, by number.
  std::map<int64_t, uint64_t> pending_;
  /// Payload hashes of the last 8192 numbers taken: they tell a repetition from a contradiction.
  /// In order of the numbers.
  std::deque<std::pair<int64_t, uint64_t>> recent_;
  /// The earliest and the latest sim time, µs; -1 before the first.
  int64_t first_time_us_ = -1, last_time_us_ = -1;
};

}  // namespace morphbus::logger
