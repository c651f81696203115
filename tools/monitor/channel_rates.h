#pragma once
// Rates and losses of a bus's channels, for viewers who draw them over time.

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "bridge/outward/monitor.pb.h"
#include "tools/spy/channel_table.h"
#include "tools/spy/lcm_schema.h"

namespace morphbus::tools {

/// The spy's table of channels, told in intervals.
class ChannelRates {
 public:
  ChannelRates();
  ChannelRates(const ChannelRates&) = delete;
  ChannelRates& operator=(const ChannelRates&) = delete;

  /// A message that came at `now_s`, seconds on any clock that does not go back: sim time, so that
  /// a rate is that of the robot however fast the run goes.
  void Take(std::string_view channel, const uint8_t* data, size_t size, double now_s);
  /// All counts; rates are those since the last call, or since the first message. What comes on
  /// channels for which there is no place is counted as one.
  morphbus::Channels Roll(double now_s);

 private:
  LcmSchema schema_;
  ChannelTable table_;
  /// Messages and bytes of each channel at the last Roll, and when that was; below 0 before the
  /// first message.
  std::map<std::string, std::pair<int64_t, int64_t>> told_;
  double begin_s_ = -1;
};

}  // namespace morphbus::tools
