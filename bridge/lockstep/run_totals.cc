#include "bridge/lockstep/run_totals.h"

#include <algorithm>
#include <map>

#include "bridge/wire/ask_layout.h"
#include "bridge/wire/channels.h"

namespace morphbus::bridge {

using morphbus::ask_t;

std::vector<ask_t> SplitTotals(const ask_t& pattern, const WireTotals& totals) {
  std::vector<ask_t> parts = {pattern};
  for (const morphbus::channel_total_t& total : totals) {
    const size_t size = static_cast<size_t>(parts.back().getEncodedSize()) +
                        static_cast<size_t>(total._getEncodedSizeNoHash());
    if (size > kMaxPayloadBytes || parts.back().num_totals >= layout::kMostTotals) {
      parts.push_back(pattern);
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

bool TotalsParts::Take(const ask_t& part) {
  // A report of a later tick begins anew: the process has gone on since the one before.
  if (part.num_parts < 1 || part.acknowledged_tick < acknowledged_tick_) return false;
  if (missing_ < 0 || part.acknowledged_tick > acknowledged_tick_) {
    missing_ = part.num_parts;
    parts_.assign(static_cast<size_t>(part.num_parts), false);
    totals_.clear();
    acknowledged_tick_ = part.acknowledged_tick;
  }
  // A part may come any number of times.
  const auto number = static_cast<size_t>(part.part);
  if (number >= parts_.size() || parts_[number]) return false;
  parts_[number] = true;
  totals_.insert(totals_.end(), part.totals.begin(), part.totals.end());
  return --missing_ == 0;
}

std::string WhereTheLogDiffers(const std::vector<ChannelTotal>& published,
                               const WireTotals& recorded) {
  std::map<std::string, const morphbus::channel_total_t*> in_log;
  for (const morphbus::channel_total_t& total : recorded) in_log[total.channel] = &total;
  std::string first;
  int more = 0;
  for (const ChannelTotal& total : published) {
    if (!total.hashed) continue;
    const auto found = in_log.find(total.channel);
    const int64_t count = found == in_log.end() ? 0 : found->second->count;
    const auto hash =
        found == in_log.end() ? uint64_t{0} : static_cast<uint64_t>(found->second->chained_hash);
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
