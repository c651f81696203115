#include "bridge/outward/channel_counts.h"

#include "bridge/observe/run_message.h"
#include "compiler/base/text.h"

namespace morphbus::bridge {
namespace {

/// So many channels are told apart, whatever names come.
constexpr size_t kMostChannels = 1024;

/// The type of what travels under a topic.
const char* TypeOf(Topic topic) {
  switch (topic) {
    case Topic::kClock:
      return "morphbus.sim_clock_t";
    case Topic::kSensors:
      return "morphbus.sensors_t";
    case Topic::kWorld:
      return "morphbus.world_t";
    case Topic::kTransform:
      return "morphbus.transform_t";
    case Topic::kActuator:
      return "morphbus.actuator_t";
    case Topic::kStatus:
      return "morphbus.status_t";
    case Topic::kHealth:
      return "morphbus.health_t";
    case Topic::kAsk:
      return "morphbus.ask_t";
    case Topic::kHello:
      return "morphbus.hello_t";
    case Topic::kInfo:
      return "morphbus.info_part_t";
    case Topic::kControl:
      return "morphbus.control_t";
    case Topic::kEnd:
      return "morphbus.log_end_t";
  }
  return "";
}

}  // namespace

void ChannelCounts::Take(std::string_view channel, const uint8_t* data, size_t size, double now_s) {
  // The first message begins the first interval.
  if (interval_begin_s_ < 0) interval_begin_s_ = now_s;
  // Beyond the bound all further names share one entry.
  auto found = counts_.find(channel);
  if (found == counts_.end()) {
    const bool full = counts_.size() >= kMostChannels;
    found = counts_.try_emplace(full ? "(further channels)" : std::string(channel)).first;
  }
  Count& count = found->second;
  ++count.messages;
  ++count.interval_messages;
  count.interval_bytes += static_cast<int64_t>(size);
  // Only what is ours can be looked into; other programs' messages are counted.
  if (!ParseChannel(channel)) return;
  const Result<RunMessage> message = OpenMessage(channel, data, size);
  if (!message) {
    ++count.bad;
    return;
  }
  const Topic topic = message->name.topic;
  count.type = TypeOf(topic);
  if (!HasManyPublishers(topic)) count.gaps.Take(message->header.sequence);
}

morphbus::Channels ChannelCounts::Roll(double now_s) {
  morphbus::Channels channels;
  // Without an interval there is no rate, and it stays unset.
  const double interval_s = interval_begin_s_ < 0 ? 0 : now_s - interval_begin_s_;
  for (auto& [name, count] : counts_) {
    morphbus::ChannelCount& out = *channels.add_channels();
    out.set_channel(EscapeControl(name));
    out.set_type(count.type);
    out.set_messages(count.messages);
    out.set_lost(count.gaps.lost());
    out.set_bad(count.bad);
    if (interval_s > 0) {
      out.set_hz(static_cast<double>(count.interval_messages) / interval_s);
      out.set_bytes_per_s(static_cast<double>(count.interval_bytes) / interval_s);
    }
    // The next interval begins.
    count.interval_messages = count.interval_bytes = 0;
  }
  interval_begin_s_ = now_s;
  return channels;
}

}  // namespace morphbus::bridge
