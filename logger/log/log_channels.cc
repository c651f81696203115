#include "logger/log/log_channels.h"

#include <optional>

#include "compiler/base/text.h"

namespace morphbus::logger {
namespace {

/// A damaged log can name any number of channels; beyond this they are counted as one. A module has
/// five, and a robot at most some 30,000 modules.
constexpr size_t kMaxChannels = 200'000;

}  // namespace

LogChannels::Known& LogChannels::Of(const LogEvent& event) {
  const auto found = known_.find(event.channel);
  if (found != known_.end()) return *found->second;
  const bool remembered = known_.size() < kMaxChannels;
  auto made = std::make_unique<Known>();
  Known& known = *made;
  known.raw = event.channel;
  // The channel's name tells whose event it is.
  const std::optional<bridge::ChannelName> name = bridge::ParseChannel(known.raw);
  known.ours = name && name->run == run_;
  if (name) known.name = *name;
  if (name && !known.ours) other_runs_.emplace(name->run);
  found_ = found_ || known.ours;
  // The facts list it by a name that can be printed, under which two channels may even fall
  // together.
  std::string key = EscapeControl(event.channel);
  if (facts_.channels.size() >= kMaxChannels && !facts_.channels.contains(key)) {
    key = "(further channels)";
  }
  known.facts = &facts_.channels[key];
  ChannelFacts& channel = *known.facts;
  // The first event of a name settles whose channel it is.
  if (channel.events == 0) {
    channel.channel = key;
    channel.first_us = event.timestamp_us;
    channel.ours = known.ours;
    channel.hashed = known.ours && bridge::IsHashed(name->topic);
  }
  if (known.ours && channel.ours) known.stream = &streams_[channel.channel];
  // One too many is made anew for each of its events, in one place that is used again.
  if (!remembered) {
    unremembered_ = std::move(made);
    return *unremembered_;
  }
  return *known_.emplace(known.raw, std::move(made)).first->second;
}

}  // namespace morphbus::logger
