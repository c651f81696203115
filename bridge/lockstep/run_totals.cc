#include "bridge/lockstep/run_totals.h"

#include <algorithm>

#include "bridge/wire/ask_layout.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"

namespace morphbus::bridge {
namespace {

using morphbus::ask_t;

/// Bytes of the message as it travels.
size_t SizeOf(const ask_t& ask) { return static_cast<size_t>(ask.getEncodedSize()); }

/// A hash of what a part says, without its header, which counts up with every repetition.
uint64_t ContentOf(ask_t part) {
  part.header = morphbus::header_t();
  // LCM's structs leave their numbers unset.
  part.header.auth = part.header.crc32 = part.header.protocol = 0;
  part.header.tick = part.header.sim_time_us = part.header.sequence = 0;
  part.header.model_hash = part.header.program_hash = 0;
  std::vector<uint8_t> bytes;
  Encode(part, &bytes);
  return DigestOf(bytes.data(), bytes.size());
}

}  // namespace

std::vector<ask_t> SplitReport(const ask_t& pattern, const TotalsReport& report) {
  std::vector<ask_t> parts = {pattern};
  // The part that can take another entry, or a new one if the last is full.
  const auto room_for = [&](int entry_bytes) -> ask_t& {
    const ask_t& last = parts.back();
    const bool full = SizeOf(last) + static_cast<size_t>(entry_bytes) > kMaxPayloadBytes ||
                      std::max(last.num_totals, last.num_taken) >= layout::kMostTotals;
    if (full) parts.push_back(pattern);
    return parts.back();
  };
  // All entries, each where it finds room.
  for (const morphbus::channel_total_t& total : report.totals) {
    ask_t& part = room_for(total._getEncodedSizeNoHash());
    part.totals.push_back(total);
    ++part.num_totals;
  }
  for (const morphbus::taken_total_t& taken : report.taken) {
    ask_t& part = room_for(taken._getEncodedSizeNoHash());
    part.taken.push_back(taken);
    ++part.num_taken;
  }
  // How many parts there are is known only now.
  for (size_t i = 0; i < parts.size(); ++i) {
    parts[i].part = static_cast<int16_t>(i);
    parts[i].num_parts = static_cast<int16_t>(parts.size());
  }
  return parts;
}

ReportParts::Kind ReportParts::Take(const ask_t& part) {
  // The first part says how many there are; without any there is no report. No run has so many
  // channels that a report needs more.
  constexpr int kMostParts = 4096;
  if (part.num_parts < 1 || part.num_parts > kMostParts) return Kind::kContradicts;
  // A report of a later tick begins anew: the process has gone on since the one before.
  if (missing_ < 0 || part.acknowledged_tick > acknowledged_tick_) {
    missing_ = part.num_parts;
    parts_.assign(static_cast<size_t>(part.num_parts), std::nullopt);
    report_ = TotalsReport();
    acknowledged_tick_ = part.acknowledged_tick;
  }
  if (part.acknowledged_tick < acknowledged_tick_) return Kind::kRepeated;
  if (static_cast<size_t>(part.num_parts) != parts_.size()) return Kind::kContradicts;
  // A part may come any number of times, but always with the same content.
  std::optional<uint64_t>& known = parts_[part.part];
  const uint64_t content = ContentOf(part);
  if (known) return *known == content ? Kind::kRepeated : Kind::kContradicts;
  known = content;
  verdict_ = part.verdict;
  report_.totals.insert(report_.totals.end(), part.totals.begin(), part.totals.end());
  report_.taken.insert(report_.taken.end(), part.taken.begin(), part.taken.end());
  return --missing_ == 0 ? Kind::kComplete : Kind::kPart;
}

void RunTotals::Given(const std::string& channel, int part, const std::string& taker,
                      const TakenSum& what) {
  pairs_[{channel, part, taker}].given = what;
}

void RunTotals::Taken(const std::string& channel, int part, const std::string& taker,
                      const TakenSum& what) {
  pairs_[{channel, part, taker}].taken = what;
}

std::string RunTotals::Disagreement(bool lossy) const {
  std::string first;
  int more = 0;
  for (const auto& [key, sides] : pairs_) {
    const auto& [channel, part, taker] = key;
    // Every channel here was made or checked by the sim.
    const std::optional<ChannelName> name = ParseChannel(channel);
    const std::string publisher(name ? name->process : "");
    if (!reported_.contains(publisher) || !reported_.contains(taker)) continue;
    // Whoever says nothing of a channel says that there was nothing.
    const TakenSum given = sides.given.value_or(TakenSum());
    const TakenSum taken = sides.taken.value_or(TakenSum());
    if (given == taken || (lossy && taken.count < given.count)) continue;
    // The first difference is told in words, the others are counted.
    if (!first.empty()) {
      ++more;
      continue;
    }
    first = taker + (taker == kLogProcess ? " recorded" : " took") + " other messages on " +
            publisher + "/" + std::string(name ? TopicName(name->topic) : "") + " than " +
            publisher + " published (" + std::to_string(taken.count) + " of " +
            std::to_string(given.count) + ")";
  }
  if (more > 0) first += ", and " + std::to_string(more) + " more such differences";
  return first;
}

}  // namespace morphbus::bridge
