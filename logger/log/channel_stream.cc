#include "logger/log/channel_stream.h"

#include <algorithm>

namespace morphbus::logger {
namespace {

/// A gap is given up once more than this many later messages wait for it.
constexpr size_t kPatience = 4096;
/// So many payload hashes are kept, to tell a repetition from a contradiction.
constexpr size_t kRemembered = 8192;

}  // namespace

/// Takes the next message of the unbroken row.
void ChannelStream::Append(int64_t sequence, uint64_t digest) {
  hash_.Add(digest);
  ++count_;
  next_ = sequence + 1;
}

/// Takes what waits in order; gives up gaps while more than `keep` messages wait.
void ChannelStream::Drain(size_t keep) {
  while (!pending_.empty()) {
    const auto first = pending_.begin();
    // A gap lies before the first waiting message: it is left open while few messages wait.
    if (first->first != next_) {
      if (pending_.size() <= keep) return;
      if (first_lost_ < 0) first_lost_ = next_;
      lost_ += first->first - next_;
    }
    Append(first->first, first->second);
    pending_.erase(first);
  }
}

ChannelStream::Kind ChannelStream::Take(int64_t sequence, std::span<const uint8_t> payload) {
  // It tells a message that came twice from another one under the same number.
  const uint64_t hash = bridge::MessageDigest(payload.data(), payload.size());
  // A number seen before is a repetition, byte for byte, or a contradiction. Most numbers are
  // higher than all before.
  auto place = recent_.end();
  if (!recent_.empty() && sequence <= recent_.back().first) {
    place = std::ranges::lower_bound(recent_, sequence, {}, &std::pair<int64_t, uint64_t>::first);
  }
  if (place != recent_.end() && place->first == sequence) {
    if (place->second != hash) return Kind::kConflict;
    ++duplicates_;
    return Kind::kDuplicate;
  }
  // The number was taken or given up so long ago that its hash is forgotten: it cannot be compared.
  if (sequence < next_) {
    ++duplicates_;
    return Kind::kDuplicate;
  }
  // Old numbers are forgotten, so that a long log costs no more memory than a short one.
  recent_.emplace(place, sequence, hash);
  if (recent_.size() > kRemembered) recent_.pop_front();
  // A message that came early waits until those before it are there or given up.
  if (sequence == next_) {
    Append(sequence, hash);
  } else {
    pending_.emplace(sequence, hash);
  }
  Drain(kPatience);
  return Kind::kNew;
}

void ChannelStream::TakeUnnumbered(std::span<const uint8_t> payload) {
  hash_.Update(payload.data(), payload.size());
  ++count_;
}

void ChannelStream::TakeTime(int64_t time_us) {
  first_time_us_ = first_time_us_ < 0 ? time_us : std::min(first_time_us_, time_us);
  last_time_us_ = std::max(last_time_us_, time_us);
}

void ChannelStream::Finish() { Drain(0); }

double ChannelStream::sim_seconds() const {
  return first_time_us_ < 0 ? 0.0 : static_cast<double>(last_time_us_ - first_time_us_) * 1e-6;
}

}  // namespace morphbus::logger
