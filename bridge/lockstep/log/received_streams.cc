#include "bridge/lockstep/log/received_streams.h"

#include <algorithm>

namespace morphbus::bridge {

namespace {

/// Numbers of which a channel's bytes are remembered at most.
constexpr int64_t kMostRemembered = 8192;

}  // namespace

void ReceivedStream::Add(int64_t sequence, uint64_t digest, bool in_order) {
  ++count;
  gapless &= sequence == next;
  // In lockstep every gap gets filled, so a payload beyond one waits for its turn in the hash. In
  // real time nothing is sent again, and payloads are hashed as they arrive.
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

ReceivedStream* ReceivedStreams::Find(std::string_view channel) {
  // The channel is mostly the one that came next a tick ago.
  ReceivedStream* stream = last_ == nullptr ? nullptr : last_->follower;
  if (stream == nullptr || stream->channel != channel) {
    const auto found = streams_.find(channel);
    if (found == streams_.end()) return nullptr;
    stream = found->second.get();
    if (last_ != nullptr) last_->follower = stream;
  }
  // Has the processor fetch what the next message will need.
  if (const ReceivedStream* next = stream->follower; next != nullptr) {
    __builtin_prefetch(next->channel.data());
    next->tracker.FetchNext();
    __builtin_prefetch(next->follower);
  }
  last_ = stream;
  return stream;
}

ReceivedStream& ReceivedStreams::Begin(std::string_view channel, int module, int64_t numbers) {
  const auto index = static_cast<int>(streams_.size());
  const auto place =
      streams_.emplace(std::string(channel), std::make_unique<ReceivedStream>()).first;
  ReceivedStream& stream = *place->second;
  stream.index = index;
  stream.module = module;
  // The parts of the name are views into the table's own text, which stays where it is.
  stream.channel = place->first;
  stream.name = *ParseChannel(place->first);
  stream.tracker.Remember(static_cast<size_t>(std::min(numbers, kMostRemembered)));
  return stream;
}

std::vector<ChannelTotal> ReceivedStreams::totals() const {
  std::vector<ChannelTotal> totals;
  for (const auto& [channel, stream] : streams_) {
    totals.push_back({channel, stream->count, static_cast<int64_t>(stream->hash.Digest()), true});
  }
  // Both sides of the comparison, and the run's hash, go by name.
  std::ranges::sort(totals, {}, &ChannelTotal::channel);
  return totals;
}

std::string ReceivedStreams::FirstDifference(const std::string& prefix,
                                             const std::vector<morphbus::topic_total_t>& published,
                                             bool realtime) const {
  for (const morphbus::topic_total_t& total : published) {
    const auto found = streams_.find(prefix + total.topic);
    // What has not come yet may still be under way.
    if (found == streams_.end()) continue;
    const ReceivedStream& stream = *found->second;
    // Hashes can be compared only where both are over the same messages in the same order.
    const bool comparable =
        stream.early.empty() && stream.count == total.count && (!realtime || stream.gapless);
    if (comparable && stream.hash.Digest() != static_cast<uint64_t>(total.chained_hash)) {
      return total.topic;
    }
  }
  return {};
}

}  // namespace morphbus::bridge
