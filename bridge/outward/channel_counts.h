#pragma once
// Rates and losses of a bus's channels, for viewers.

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "bridge/observe/gap_counter.h"
#include "bridge/outward/monitor.pb.h"

namespace morphbus::bridge {

/// Counts what travels on each channel, for viewers who draw rates over time; the spy, which also
/// tells jitter and needs no protobuf, has a table of its own (tools/spy/channel_table.h). Never
/// grows beyond 1024 channels, whatever others publish; what comes on further ones is counted as
/// one.
class ChannelCounts {
 public:
  /// A message that came at `now_s` (any clock that does not go back).
  void Take(std::string_view channel, const uint8_t* data, size_t size, double now_s);
  /// All counts; rates are those since the last call, or since the first message.
  morphbus::Channels Roll(double now_s);

 private:
  struct Count {
    std::string type;  ///< LCM type; empty if no message could be read.
    int64_t messages = 0,
            bad = 0;  ///< Since the first message; bad ones are ours that are damaged.
    int64_t interval_messages = 0, interval_bytes = 0;  ///< Since the last Roll.
    GapCounter gaps;                                    ///< Of channels that have one publisher.
  };
  std::map<std::string, Count, std::less<>> counts_;  ///< By channel.
  double interval_begin_s_ = -1;                      ///< Negative before the first message.
};

}  // namespace morphbus::bridge
