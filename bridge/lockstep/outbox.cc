#include "bridge/lockstep/outbox.h"

#include <algorithm>
#include <limits>

#include "bridge/lockstep/snapshot_bytes.h"

namespace morphbus::bridge {
namespace {

// More than this no sound snapshot holds: a module has three hashed channels.
constexpr uint32_t kMostStreams = 3;
constexpr uint32_t kMostKept = 4096;

/// Numbers of a process' share on a channel outside the hash, and shares of an incarnation: more
/// than any of them needs.
constexpr int64_t kNumbersAShare = int64_t{1} << 32;
constexpr int64_t kShares = int64_t{1} << 16;

}  // namespace

Outbox::Outbox(Bus* bus, Sender sender, Ledger* ledger)
    : bus_(bus), sender_(std::move(sender)), ledger_(ledger) {}

Outbox::Streams::value_type& Outbox::StreamOf(const std::string& channel) {
  const auto [found, fresh] = streams_.try_emplace(channel);
  if (!fresh) return *found;
  // A new channel: only hashed ones are kept and hashed.
  const std::optional<ChannelName> name = ParseChannel(channel);
  MORPHBUS_CHECK(name.has_value());
  found->second.hashed = IsHashed(name->topic);
  if (!found->second.hashed) found->second.next_sequence = first_unhashed_;
  return *found;
}

void Outbox::BeginAt(uint32_t incarnation, int64_t restarts) {
  // The last incarnations that there can be share one range, so that no number overflows.
  constexpr int64_t kMostIncarnations = int64_t{1} << 14;
  const int64_t earlier = std::clamp<int64_t>(int64_t{incarnation} - 1, 0, kMostIncarnations);
  first_unhashed_ = (earlier * kShares + std::min(restarts, kShares - 1)) * kNumbersAShare;
}

void Outbox::FillHeader(const Stream& stream, int64_t tick, int64_t sim_time_us,
                        morphbus::header_t* header) {
  // CRC and auth are put in once the message is encoded.
  header->crc32 = 0;
  header->auth = 0;
  header->protocol = morphbus::header_t::PROTOCOL;
  header->tick = tick;
  header->sim_time_us = sim_time_us;
  header->sequence = stream.next_sequence;
  header->model_hash = static_cast<int64_t>(sender_.model_hash);
  header->program_hash = static_cast<int64_t>(sender_.program_hash);
}

void Outbox::Commit(Streams::value_type* to, int64_t tick) {
  Stream* stream = &to->second;
  // One packet of the network holds a whole message (bridge/wire/wire_limits.h).
  MORPHBUS_CHECK(scratch_.size() <= kMaxPayloadBytes);
  // Numbered and counted; what counts for the hash is also hashed and kept.
  const int64_t sequence = stream->next_sequence++;
  ++ledger_->sent;
  if (stream->hashed) {
    stream->hash.Update(scratch_.data(), scratch_.size());
    // Messages older than the window are asked for by nobody; their buffers are used again.
    while (!stream->kept.empty() && stream->kept.front().tick <= tick - kKeptTicks) {
      spare_.push_back(std::move(stream->kept.front().bytes));
      stream->kept.pop_front();
    }
    // A copy of the bytes stays here, in a buffer that was used before if there is one.
    Kept kept{sequence, tick, {}};
    if (!spare_.empty()) {
      kept.bytes = std::move(spare_.back());
      spare_.pop_back();
    }
    kept.bytes = scratch_;
    stream->kept.push_back(std::move(kept));
  }
  // While messages are held back, others go out at once.
  if (holding_back_ && stream->hashed) {
    outgoing_.emplace_back(to, &stream->kept.back());
    return;
  }
  bus_->Publish(to->first, scratch_.data(), scratch_.size());
}

void Outbox::Hold() { holding_back_ = true; }

void Outbox::Release() {
  // In the order in which they were sent.
  holding_back_ = false;
  for (const auto& [to, kept] : outgoing_) {
    bus_->Publish(to->first, kept->bytes.data(), kept->bytes.size());
  }
  outgoing_.clear();
}

int Outbox::Resend(const std::string& channel, int64_t first, int64_t last,
                   std::optional<int64_t> asked_us) {
  constexpr int kSoonAgain = 16;
  const auto found = streams_.find(channel);
  if (found == streams_.end()) return 0;
  // What is no longer kept cannot be sent again; who asks gives up in the end.
  int sent = 0;
  for (Kept& kept : found->second.kept) {
    if (kept.sequence < first || kept.sequence > last) continue;
    if (asked_us) {
      // Who asked hears the answer that was given to somebody else a moment ago.
      if (*asked_us < kept.answered_until_us) continue;
      kept.answered_until_us =
          *asked_us + (++kept.times_answered > kSoonAgain ? kResendPauseUs : kSoonAgainUs);
    }
    bus_->Publish(channel, kept.bytes.data(), kept.bytes.size());
    ++sent;
  }
  ledger_->resent += sent;
  return sent;
}

void Outbox::ContinueAfter(const std::string& channel, int64_t count) {
  Stream& stream = StreamOf(channel).second;
  stream.next_sequence = count;
  stream.partial = count > 0;
}

int64_t Outbox::count(const std::string& channel) const {
  const auto found = streams_.find(channel);
  return found == streams_.end() ? 0 : found->second.next_sequence;
}

std::vector<ChannelTotal> Outbox::totals() const {
  std::vector<ChannelTotal> totals;
  for (const auto& [channel, stream] : streams_) {
    // HEALTH, HELLO and the like do not count for the run's hash.
    if (!stream.hashed || stream.partial) continue;
    totals.push_back(
        {channel, stream.next_sequence, static_cast<int64_t>(stream.hash.Digest()), true});
  }
  std::ranges::sort(totals, {}, &ChannelTotal::channel);
  return totals;
}

void Outbox::Save(std::vector<uint8_t>* out) const {
  PutBytes(out, first_unhashed_);
  const auto is_saved = [](const Streams::value_type& entry) { return entry.second.hashed; };
  PutBytes(out, static_cast<uint32_t>(std::count_if(streams_.begin(), streams_.end(), is_saved)));
  // Each channel: name, next number, state of its hash, and the messages kept.
  for (const Streams::value_type& entry : streams_) {
    if (!is_saved(entry)) continue;
    const auto& [channel, stream] = entry;
    PutText(out, channel);
    PutBytes(out, stream.next_sequence);
    PutBytes(out, stream.partial);
    PutBytes(out, stream.hash.Digest());
    // The kept messages, oldest first, each with its length before its bytes.
    PutBytes(out, static_cast<uint32_t>(stream.kept.size()));
    for (const Kept& kept : stream.kept) {
      PutBytes(out, kept.sequence);
      PutBytes(out, kept.tick);
      PutBytes(out, static_cast<uint32_t>(kept.bytes.size()));
      PutRaw(out, kept.bytes.data(), kept.bytes.size());
    }
  }
}

Result<size_t> Outbox::Load(const uint8_t* data, size_t size) {
  SnapshotReader in{data, size};
  // Every length is checked before it is believed: the file may be cut or damaged.
  streams_.clear();
  // What was said outside the hash after the snapshot is known to nobody but those who heard it.
  const auto saved_first = in.Get<int64_t>();
  if (saved_first < 0 || saved_first > std::numeric_limits<int64_t>::max() - 2 * kNumbersAShare) {
    return Fail("the snapshot counts what no process says");
  }
  first_unhashed_ = std::max(first_unhashed_, saved_first + kNumbersAShare);
  const auto num_streams = in.Get<uint32_t>();
  for (uint32_t i = 0; i < num_streams && num_streams <= kMostStreams && in.ok; ++i) {
    const std::string channel = in.GetText();
    if (!in.ok) break;
    if (!ParseChannel(channel)) return Fail("the snapshot names a channel that is none");
    Stream& stream = StreamOf(channel).second;
    // Number and hash go on where they were, so the run's hash does not show the interruption.
    stream.next_sequence = in.Get<int64_t>();
    stream.partial = in.Get<uint8_t>() != 0;
    stream.hash.Resume(in.Get<uint64_t>());
    const auto num_kept = in.Get<uint32_t>();
    if (num_kept > kMostKept) return Fail("the snapshot keeps too many messages");
    // What others may still ask for comes back as it was.
    for (uint32_t k = 0; k < num_kept && in.ok; ++k) {
      Kept kept{in.Get<int64_t>(), in.Get<int64_t>(), {}};
      const auto bytes = in.Get<uint32_t>();
      if (const uint8_t* from = in.Take(bytes)) kept.bytes.assign(from, from + bytes);
      stream.kept.push_back(std::move(kept));
    }
  }
  if (!in.ok || num_streams > kMostStreams) return Fail("the snapshot is cut short or damaged");
  return size - in.left;
}

}  // namespace morphbus::bridge
