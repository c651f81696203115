#pragma once
// One channel's messages put into order of their sequence numbers: what is lost, what came twice,
// and the hash that the run's END event must agree with.

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "bridge/stream_hash.h"

namespace morphbus::logger {

class ChannelLine {
 public:
  enum class Kind { kNew, kDuplicate, kConflict };

  /// Takes a numbered message; numbers begin at 0. A gap is given up, and counted as lost, once
  /// 4096 later messages have come, so memory stays bounded.
  Kind Take(int64_t sequence, std::span<const uint8_t> payload);
  /// Takes a message of a channel without common numbering; hashed in the order of the file.
  void TakeUnnumbered(std::span<const uint8_t> payload);
  /// Notes the sim time of a message.
  void TakeTime(int64_t time_us);
  /// Gives up all gaps. Call before the getters.
  void Finish();

  [[nodiscard]] int64_t count() const { return count_; }
  [[nodiscard]] int64_t duplicates() const { return duplicates_; }
  [[nodiscard]] int64_t lost() const { return lost_; }
  [[nodiscard]] int64_t first_lost() const { return first_lost_; }
  [[nodiscard]] uint64_t hash() const { return hash_.Digest(); }
  /// Between the earliest and the latest message.
  [[nodiscard]] double sim_seconds() const;

 private:
  void Append(int64_t sequence, std::span<const uint8_t> payload);
  void Drain(size_t keep);

  bridge::StreamHash hash_;
  int64_t count_ = 0, duplicates_ = 0, lost_ = 0, first_lost_ = -1;
  int64_t next_ = 0;  ///< All below were taken or given up.
  std::map<int64_t, std::vector<uint8_t>> pending_;
  std::map<int64_t, uint64_t> recent_;  ///< Payload hashes of the last taken numbers.
  int64_t first_time_us_ = -1, last_time_us_ = -1;
};

}  // namespace morphbus::logger
