// What a LogParticipant knows of what was recorded, and how it compares that, while the run goes
// on, with what the others say they published.

#include <algorithm>
#include <morphbus/health_t.hpp>
#include <string>
#include <string_view>

#include "bridge/lockstep/log_participant.h"

namespace morphbus::bridge {

namespace {

/// Numbers of which a channel's bytes are remembered at most.
constexpr size_t kMostRemembered = 8192;

}  // namespace

void ReceivedStream::Add(int64_t sequence, uint64_t digest, bool in_order) {
  ++count;
  gapless &= sequence == next;
  // In lockstep every gap gets filled, so a payload beyond one waits for its turn in the hash. In
  // real time nobody sends anything again, and payloads are hashed as they arrive.
  if (!in_order || sequence == next) {
    hash.Add(digest);
    next = sequence + 1;
  } else {
    early.emplace(sequence, digest);
  }
  // Whatever the new payload was holding up follows.
  while (!early.empty() && early.begin()->first == next) {
    hash.Add(early.begin()->second);
    early.erase(early.begin());
    ++next;
  }
}

void ReceivedStream::Fetch() const {
  __builtin_prefetch(channel.data());
  tracker.FetchNext();
  __builtin_prefetch(follower);
}

ReceivedStream* LogParticipant::FindStream(std::string_view channel) {
  // One tick is like another, so that the channel is mostly the one that came next a tick ago. The
  // streams of a thousand modules are more than a processor has at hand: it fetches them meanwhile.
  ReceivedStream* stream = last_stream_ == nullptr ? nullptr : last_stream_->follower;
  if (stream == nullptr || stream->channel != channel) {
    const auto found = streams_.find(channel);
    if (found == streams_.end()) return nullptr;
    stream = found->second.get();
    if (last_stream_ != nullptr) last_stream_->follower = stream;
  }
  if (stream->follower != nullptr) stream->follower->Fetch();
  last_stream_ = stream;
  return stream;
}

ReceivedStream& LogParticipant::BeginStream(std::string_view channel) {
  // The first payload of a channel begins its hash.
  auto stream = std::make_unique<ReceivedStream>();
  stream->index = static_cast<int>(streams_.size());
  const auto place = streams_.emplace(std::string(channel), std::move(stream)).first;
  // The parts of the name are views into the table's own text, which stays where it is.
  place->second->channel = place->first;
  place->second->name = *ParseChannel(place->first);
  place->second->module = machine_.ModuleNumber(place->second->name.process);
  // Of its numbers a window of ticks is remembered; in each the simulator's may have many parts.
  const bool in_parts = place->second->name.process == kSimProcess;
  const auto numbers =
      static_cast<size_t>(2 * options_.window * (in_parts ? machine_.most_parts() : 1));
  place->second->tracker.Remember(std::min(numbers, kMostRemembered));
  return *place->second;
}

std::vector<ChannelTotal> LogParticipant::totals() const {
  std::vector<ChannelTotal> totals;
  for (const auto& [channel, stream] : streams_) {
    totals.push_back({channel, stream->count, stream->hash.Digest(), true});
  }
  std::sort(totals.begin(), totals.end(),
            [](const ChannelTotal& a, const ChannelTotal& b) { return a.channel < b.channel; });
  return totals;
}

std::string LogParticipant::run_hash() const { return RunHash(totals()); }

void LogParticipant::CompareTotals(const ChannelName& name, const uint8_t* data, size_t size) {
  // Before the run and after it there is nothing to compare.
  morphbus::health_t health;
  if (machine_.done() || !Decode(data, size, {}, &health)) return;
  for (const morphbus::topic_total_t& total : health.totals) {
    const std::string channel = options_.run + "/" + std::string(name.process) + "/" + total.topic;
    const auto found = streams_.find(channel);
    // What is under way, or was lost and is asked for, is compared at another time; in real time
    // what was lost is never.
    if (found == streams_.end() || !found->second->early.empty() ||
        found->second->count != total.count || (options_.realtime && !found->second->gapless)) {
      continue;
    }
    if (found->second->hash.Digest() == static_cast<uint64_t>(total.chained_hash)) continue;
    const std::string process(name.process);
    error_ = "LOG recorded other messages on " + process + "/" + total.topic + " than " + process +
             " published";
    return machine_.GiveUp();
  }
}

}  // namespace morphbus::bridge
