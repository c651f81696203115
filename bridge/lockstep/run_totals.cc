#include "bridge/lockstep/run_totals.h"

#include <algorithm>
#include <map>

#include "bridge/wire/channels.h"
#include "bridge/wire/lockstep_layout.h"

namespace morphbus::bridge {

std::vector<morphbus::totals_t> SplitTotals(const std::string& process, int64_t last_tick,
                                            const std::vector<ChannelTotal>& totals) {
  morphbus::totals_t empty;
  empty.process = process;
  empty.last_tick = last_tick;
  empty.num_totals = 0;
  std::vector<morphbus::totals_t> parts = {empty};
  for (const ChannelTotal& published : totals) {
    const morphbus::channel_total_t total = ToWire(published);
    const size_t size = static_cast<size_t>(parts.back().getEncodedSize()) +
                        static_cast<size_t>(total._getEncodedSizeNoHash());
    if (size > kMaxPayloadBytes || parts.back().num_totals >= layout::kMostTotals) {
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
  // A report of a later tick begins anew: the logger has got what it lacked.
  if (part.num_parts < 1 || part.last_tick < last_tick_) return false;
  if (missing_ < 0 || part.last_tick > last_tick_) {
    missing_ = part.num_parts;
    parts_.assign(static_cast<size_t>(part.num_parts), false);
    totals_.clear();
    last_tick_ = part.last_tick;
  }
  // A part may come any number of times.
  const auto number = static_cast<size_t>(part.part);
  if (number >= parts_.size() || parts_[number]) return false;
  parts_[number] = true;
  for (const morphbus::channel_total_t& total : part.totals) {
    totals_.push_back(
        {total.channel, total.count, static_cast<uint64_t>(total.chained_hash), total.hashed != 0});
  }
  return --missing_ == 0;
}

std::string WhereTheLogDiffers(const std::vector<ChannelTotal>& published,
                               const std::vector<ChannelTotal>& recorded) {
  std::map<std::string, const ChannelTotal*> in_log;
  for (const ChannelTotal& total : recorded) in_log[total.channel] = &total;
  std::string first;
  int more = 0;
  for (const ChannelTotal& total : published) {
    if (!total.hashed) continue;
    const auto found = in_log.find(total.channel);
    const int64_t count = found == in_log.end() ? 0 : found->second->count;
    const uint64_t hash = found == in_log.end() ? 0 : found->second->hash;
    if (count == total.count && (count == 0 || hash == total.hash)) continue;
    // The first difference is told in words, the others are counted.
    if (!first.empty()) {
      ++more;
      continue;
    }
    const size_t slash = total.channel.find('/');
    const std::string local = total.channel.substr(slash + 1);
    first = "LOG recorded other messages on " + local + " than " +
            local.substr(0, local.find('/')) + " published (" + std::to_string(count) + " of " +
            std::to_string(total.count) + ")";
  }
  if (more > 0) first += ", and " + std::to_string(more) + " more such differences";
  return first;
}

}  // namespace morphbus::bridge
