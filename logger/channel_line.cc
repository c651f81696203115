#include "logger/channel_line.h"

#include <algorithm>

namespace morphbus::logger {
namespace {

constexpr size_t kPatience = 4096;  ///< Later messages after which a gap is given up.
constexpr size_t kRemembered = 8192;

uint64_t HashOf(std::span<const uint8_t> payload) {
  bridge::StreamHash hash;
  hash.Update(payload.data(), payload.size());
  return hash.Digest();
}

}  // namespace

void ChannelLine::Append(int64_t sequence, std::span<const uint8_t> payload) {
  hash_.Update(payload.data(), payload.size());
  ++count_;
  next_ = sequence + 1;
}

/// Takes what waits in order; gives up gaps while more than `keep` messages wait.
void ChannelLine::Drain(size_t keep) {
  while (!pending_.empty()) {
    const auto first = pending_.begin();
    if (first->first != next_) {
      if (pending_.size() <= keep) return;
      if (first_lost_ < 0) first_lost_ = next_;
      lost_ += first->first - next_;
    }
    Append(first->first, first->second);
    pending_.erase(first);
  }
}

ChannelLine::Kind ChannelLine::Take(int64_t sequence, std::span<const uint8_t> payload) {
  const uint64_t hash = HashOf(payload);
  if (const auto seen = recent_.find(sequence); seen != recent_.end()) {
    if (seen->second != hash) return Kind::kConflict;
    ++duplicates_;
    return Kind::kDuplicate;
  }
  if (sequence < next_) {
    ++duplicates_;
    return Kind::kDuplicate;
  }
  recent_.emplace(sequence, hash);
  if (recent_.size() > kRemembered) recent_.erase(recent_.begin());
  if (sequence == next_) {
    Append(sequence, payload);
  } else {
    pending_.emplace(sequence, std::vector<uint8_t>(payload.begin(), payload.end()));
  }
  Drain(kPatience);
  return Kind::kNew;
}

void ChannelLine::TakeUnnumbered(std::span<const uint8_t> payload) {
  hash_.Update(payload.data(), payload.size());
  ++count_;
}

void ChannelLine::TakeTime(int64_t time_us) {
  first_time_us_ = first_time_us_ < 0 ? time_us : std::min(first_time_us_, time_us);
  last_time_us_ = std::max(last_time_us_, time_us);
}

void ChannelLine::Finish() { Drain(0); }

double ChannelLine::sim_seconds() const {
  return first_time_us_ < 0 ? 0.0 : static_cast<double>(last_time_us_ - first_time_us_) * 1e-6;
}

}  // namespace morphbus::logger
