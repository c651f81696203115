#include "logger/compare/log_difference.h"

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

#include "bridge/observe/run_message.h"
#include "bridge/wire/stream_hash.h"
#include "logger/log/event_log.h"

namespace morphbus::logger {
namespace {

/// What is kept of a message: enough to tell another one by, and to find it again.
struct Kept {
  int64_t tick = 0;
  int64_t sim_time_us = 0;
  uint64_t digest = 0;
};
/// The messages of one channel, by number.
using Channel = std::map<int64_t, Kept>;
/// By topic, then name, the run's left out: the order in which a tick's messages come about.
using Channels = std::map<std::pair<bridge::Topic, std::string>, Channel>;

/// "m5/ACTUATOR" of "walk/m5/ACTUATOR".
std::string WithoutRun(const std::string_view channel, const std::string_view run) {
  // Two runs have unlike names, and the rest of their channels' names is the same.
  return std::string(channel.substr(run.size() + 1));
}

/// Goes through the sound messages on the run's hashed channels, in order of the file, until
/// `visit(message, event)` returns false. Fails if the file cannot be read.
template <class Visit>
Result<void> EachHashed(const LogFacts& facts, const Visit& visit) {
  auto reader = EventLogReader::Open(facts.path);
  if (!reader) return tl::unexpected(reader.error());
  LogEvent event;
  while ((*reader)->Next(&event)) {
    const auto message = bridge::OpenMessage(event.channel, event.data.data(), event.data.size());
    if (!message || message->name.run != facts.run) continue;
    if (bridge::IsHashed(message->name.topic) && !visit(*message, event)) return {};
  }
  if (!(*reader)->io_error().empty()) return Fail(facts.path + ": " + (*reader)->io_error());
  return {};
}

/// The messages of a log. What was sent again is the same, so that the first copy counts.
Result<Channels> ReadChannels(const LogFacts& facts) {
  Channels channels;
  const Result<void> read =
      EachHashed(facts, [&](const bridge::RunMessage& message, const LogEvent& event) {
        const morphbus::header_t& header = message.header;
        // The digest leaves out what a run's key makes of the bytes, for two runs have two keys.
        channels[{message.name.topic, WithoutRun(event.channel, message.name.run)}].try_emplace(
            header.sequence, Kept{header.tick, header.sim_time_us,
                                  bridge::MessageDigest(message.data, message.size)});
        return true;
      });
  if (!read) return tl::unexpected(read.error());
  return channels;
}

/// The bytes of the message of this number; empty if the log does not have it.
Result<std::vector<uint8_t>> FindMessage(const LogFacts& facts, const UnlikeMessage& wanted) {
  std::vector<uint8_t> bytes;
  const Result<void> read =
      EachHashed(facts, [&](const bridge::RunMessage& message, const LogEvent& event) {
        if (message.name.topic != wanted.topic) return true;
        if (message.header.sequence != wanted.sequence) return true;
        if (WithoutRun(event.channel, message.name.run) != wanted.channel) return true;
        bytes.assign(event.data.begin(), event.data.end());
        return false;
      });
  if (!read) return tl::unexpected(read.error());
  return bytes;
}

/// Compares channel by channel, and finds the earliest difference.
class ChannelComparison {
 public:
  LogDifference Run(const Channels& first, const Channels& second, bool first_is_whole) {
    static const Channel none;
    for (const auto& [name, channel] : first) {
      const auto other = second.find(name);
      Compare(name, channel, other == second.end() ? none : other->second, first_is_whole);
    }
    // A channel that only the second log has.
    for (const auto& [name, channel] : second) {
      if (first_is_whole && !first.contains(name)) Compare(name, none, channel, true);
    }
    return std::move(found_);
  }

 private:
  using Name = Channels::key_type;

  void Compare(const Name& name, const Channel& first, const Channel& second, bool first_is_whole) {
    for (const auto& [sequence, message] : first) {
      ++found_.compared;
      const auto other = second.find(sequence);
      if (other == second.end() || other->second.digest != message.digest) {
        Note(name, sequence, message);
      }
    }
    // Of a log with gaps a further message of the other one may be what stood in a gap.
    if (!first_is_whole) return;
    for (const auto& [sequence, message] : second) {
      if (!first.contains(sequence)) Note(name, sequence, message);
    }
  }

  void Note(const Name& name, int64_t sequence, const Kept& message) {
    ++found_.differing;
    const auto place = std::tuple(message.tick, name, sequence);
    if (found_.first && place_ <= place) return;
    place_ = place;
    found_.first = {name.first, name.second, message.tick, message.sim_time_us, sequence, {}, {}};
  }

  LogDifference found_;
  std::tuple<int64_t, Name, int64_t> place_;
};

}  // namespace

Result<LogDifference> FirstUnlikeMessage(const LogFacts& first, const LogFacts& second) {
  const Result<Channels> of_first = ReadChannels(first);
  if (!of_first) return tl::unexpected(of_first.error());
  const Result<Channels> of_second = ReadChannels(second);
  if (!of_second) return tl::unexpected(of_second.error());
  LogDifference difference = ChannelComparison().Run(*of_first, *of_second, first.whole());
  if (!difference.first) return difference;
  // Only the message that is told of is read whole.
  const std::pair<const LogFacts*, std::vector<uint8_t>*> sides[] = {
      {&first, &difference.first->first}, {&second, &difference.first->second}};
  for (const auto& [facts, bytes] : sides) {
    Result<std::vector<uint8_t>> found = FindMessage(*facts, *difference.first);
    if (!found) return tl::unexpected(found.error());
    *bytes = std::move(*found);
  }
  return difference;
}

}  // namespace morphbus::logger
