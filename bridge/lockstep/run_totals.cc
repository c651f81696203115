#include "bridge/lockstep/run_totals.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string_view>

#include "bridge/wire/channels.h"
#include "bridge/wire/wire_limits.h"

namespace morphbus::bridge {

std::vector<morphbus::totals_t> SplitTotals(const std::string& process, int64_t last_tick,
                                            const std::vector<ChannelTotal>& totals) {
  morphbus::totals_t empty;
  empty.process = process;
  empty.last_tick = last_tick;
  const std::string hash = RunHash(totals);
  // The hash tells parts of this report from those of another one that the process made for the
  // same tick.
  empty.report_hash =
      static_cast<int64_t>(DigestOf(reinterpret_cast<const uint8_t*>(hash.data()), hash.size()));
  empty.num_totals = 0;
  std::vector<morphbus::totals_t> parts = {empty};
  for (const ChannelTotal& total : totals) {
    // A part is filled until the next channel would make it longer than a datagram.
    const size_t size = static_cast<size_t>(parts.back().getEncodedSize()) +
                        static_cast<size_t>(total._getEncodedSizeNoHash());
    if (size > kMaxPayloadBytes || parts.back().totals.size() >= kMostTotals) {
      parts.push_back(empty);
    }
    parts.back().totals.push_back(total);
    ++parts.back().num_totals;
  }
  // How many parts there are is known only now.
  for (size_t i = 0; i < parts.size(); ++i) {
    parts[i].part = static_cast<int16_t>(i);
    parts[i].num_parts = static_cast<int16_t>(parts.size());
  }
  return parts;
}

bool TotalsParts::Take(const morphbus::totals_t& part) {
  if (part.num_parts < 1 || part.last_tick < last_tick_) return false;
  // Another report begins: the logger has got what it lacked. The last whole one stays meanwhile.
  const auto num_parts = static_cast<size_t>(part.num_parts);
  if (part.last_tick > last_tick_ || part.report_hash != report_hash_ ||
      parts_.size() != num_parts) {
    parts_.assign(num_parts, false);
    gathered_.clear();
    last_tick_ = part.last_tick;
    report_hash_ = part.report_hash;
  }
  // A part may come any number of times.
  const auto number = static_cast<size_t>(part.part);
  if (number >= parts_.size() || parts_[number]) return false;
  parts_[number] = true;
  gathered_.insert(gathered_.end(), part.totals.begin(), part.totals.end());
  // Only a whole report takes the place of the one before.
  if (std::find(parts_.begin(), parts_.end(), false) != parts_.end()) return false;
  whole_ = gathered_;
  complete_ = true;
  return true;
}

namespace {

/// A channel as one side tells it and as the other does.
struct BothSides {
  int64_t published = 0, recorded = 0;
  int64_t published_hash = 0, recorded_hash = 0;
  [[nodiscard]] bool Agree() const {
    return published == recorded && (published == 0 || published_hash == recorded_hash);
  }
};

/// The process whose channel it is, and the channel's name, without the run's.
std::string_view ProcessOf(std::string_view channel) {
  const std::optional<ChannelName> name = ParseChannel(channel);
  return name ? name->process : std::string_view();
}
std::string_view LocalName(std::string_view channel) {
  return channel.substr(channel.find('/') + 1);
}

}  // namespace

std::string WhereTheLogDiffers(const std::vector<ChannelTotal>& published,
                               const std::vector<ChannelTotal>& recorded,
                               const std::set<std::string, std::less<>>& unvouched) {
  // By channel, in order of name; one that a side does not mention has no messages there.
  std::map<std::string_view, BothSides> channels;
  for (const ChannelTotal& total : recorded) {
    // Channels outside the hash may repeat or lose messages, and need not agree.
    if (!total.hashed) continue;
    BothSides& both = channels[total.channel];
    both.recorded = total.count;
    both.recorded_hash = total.chained_hash;
    // Who said the beginning is dead, and nobody else has all of it.
    if (unvouched.contains(ProcessOf(total.channel))) {
      both.published = total.count;
      both.published_hash = total.chained_hash;
    }
  }
  for (const ChannelTotal& total : published) {
    if (!total.hashed) continue;
    BothSides& both = channels[total.channel];
    both.published = total.count;
    both.published_hash = total.chained_hash;
  }
  // The first difference is told in words, the others are counted.
  std::string first;
  int more = 0;
  for (const auto& [channel, both] : channels) {
    if (both.Agree() || !first.empty()) {
      more += both.Agree() ? 0 : 1;
      continue;
    }
    first = "LOG recorded other messages on " + std::string(LocalName(channel)) + " than " +
            std::string(ProcessOf(channel)) + " published (" + std::to_string(both.recorded) +
            " of " + std::to_string(both.published) + ")";
  }
  if (more > 0) first += ", and " + std::to_string(more) + " more such differences";
  return first;
}

}  // namespace morphbus::bridge
