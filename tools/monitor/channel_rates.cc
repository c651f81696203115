#include "tools/monitor/channel_rates.h"

#include <utility>

#include "compiler/base/text.h"
#include "tools/spy/lcm_sources.h"

namespace morphbus::tools {

ChannelRates::ChannelRates() : schema_(*LcmSchema::Parse(LcmSources())), table_(&schema_) {}

void ChannelRates::Take(std::string_view channel, const uint8_t* data, size_t size, double now_s) {
  if (begin_s_ < 0) begin_s_ = now_s;
  table_.Take(channel, data, size, static_cast<int64_t>(now_s * 1e9));
}

morphbus::Channels ChannelRates::Roll(double now_s) {
  SpySnapshot now;
  table_.Snapshot(static_cast<int64_t>(now_s * 1e9), &now);
  // A bus with more channels than the table holds still shows how much is said on it.
  if (now.untold_messages > 0) {
    ChannelRow& others = now.channels.emplace_back();
    others.channel = "(further channels)";
    others.messages = now.untold_messages;
  }
  morphbus::Channels channels;
  // Without an interval there is no rate, and it stays unset.
  const double interval_s = begin_s_ < 0 ? 0.0 : now_s - begin_s_;
  // Channels that the table has dropped since are forgotten here, too.
  std::map<std::string, std::pair<int64_t, int64_t>> before = std::exchange(told_, {});
  for (const ChannelRow& row : now.channels) {
    morphbus::ChannelCount& out = *channels.add_channels();
    out.set_channel(EscapeControl(row.channel));
    out.set_type(row.type);
    out.set_messages(row.messages);
    out.set_lost(row.lost);
    out.set_bad(row.bad);
    told_[row.channel] = {row.messages, row.bytes};
    const auto [messages, bytes] = before[row.channel];
    if (interval_s > 0) {
      out.set_hz(static_cast<double>(row.messages - messages) / interval_s);
      out.set_bytes_per_s(static_cast<double>(row.bytes - bytes) / interval_s);
    }
  }
  begin_s_ = now_s;
  return channels;
}

}  // namespace morphbus::tools
