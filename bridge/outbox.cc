#include "bridge/outbox.h"

#include <algorithm>
#include <cstring>

namespace morphbus::bridge {
namespace {

/// Snapshot bytes are of the same machine and build, so native order will do.
template <class T>
void Put(std::vector<uint8_t>* out, const T& value) {
  const auto* bytes = reinterpret_cast<const uint8_t*>(&value);
  out->insert(out->end(), bytes, bytes + sizeof value);
}

/// Reads back what Put wrote; `ok` turns false at the end of the bytes.
struct SnapshotReader {
  const uint8_t* data;
  size_t left;
  bool ok = true;

  const uint8_t* Take(size_t size) {
    if (size > left) ok = false;
    if (!ok) return nullptr;
    data += size;
    left -= size;
    return data - size;
  }
  template <class T>
  T Get() {
    T value{};
    if (const uint8_t* from = Take(sizeof value)) std::memcpy(&value, from, sizeof value);
    return value;
  }
};

constexpr uint32_t kMostLines = 16;
constexpr uint32_t kMostKept = 4096;

}  // namespace

Outbox::Outbox(Bus* bus, Speaker speaker, Ledger* ledger)
    : bus_(bus), speaker_(std::move(speaker)), ledger_(ledger) {}

Outbox::Line& Outbox::LineOf(const std::string& channel) {
  const auto found = lines_.find(channel);
  if (found != lines_.end()) return found->second;
  Line& line = lines_[channel];
  const std::optional<ChannelName> name = ParseChannel(channel);
  MORPHBUS_CHECK(name.has_value());
  line.hashed = IsHashed(name->topic);
  return line;
}

void Outbox::FillHeader(const Line& line, int64_t tick, int64_t sim_time_us,
                        morphbus::header_t* header) {
  header->crc32 = 0;
  header->protocol = morphbus::header_t::PROTOCOL;
  header->tick = tick;
  header->sim_time_us = sim_time_us;
  header->sequence = line.next_sequence;
  header->model_hash = static_cast<int64_t>(speaker_.model_hash);
  header->program_hash = static_cast<int64_t>(speaker_.program_hash);
}

void Outbox::Commit(const std::string& channel, Line* line, int64_t tick) {
  MORPHBUS_CHECK(scratch_.size() <= kMaxPayloadBytes);
  const int64_t sequence = line->next_sequence++;
  ++ledger_->sent;
  if (line->hashed) {
    line->hash.Update(scratch_.data(), scratch_.size());
    while (!line->kept.empty() && line->kept.front().tick <= tick - kKeptTicks) {
      spare_.push_back(std::move(line->kept.front().bytes));
      line->kept.pop_front();
    }
    Kept kept{sequence, tick, {}};
    if (!spare_.empty()) {
      kept.bytes = std::move(spare_.back());
      spare_.pop_back();
    }
    kept.bytes = scratch_;
    line->kept.push_back(std::move(kept));
  }
  if (held_ && line->hashed) {
    outgoing_.emplace_back(channel, sequence);
    return;
  }
  bus_->Publish(channel, scratch_.data(), scratch_.size());
}

void Outbox::Hold() { held_ = true; }

void Outbox::Release() {
  held_ = false;
  for (const auto& [channel, sequence] : outgoing_) {
    for (const Kept& kept : lines_[channel].kept) {
      if (kept.sequence == sequence) bus_->Publish(channel, kept.bytes.data(), kept.bytes.size());
    }
  }
  outgoing_.clear();
}

int Outbox::Resend(const std::string& channel, int64_t first, int64_t last) {
  const auto found = lines_.find(channel);
  if (found == lines_.end()) return 0;
  int sent = 0;
  for (const Kept& kept : found->second.kept) {
    if (kept.sequence < first || kept.sequence > last) continue;
    bus_->Publish(channel, kept.bytes.data(), kept.bytes.size());
    ++sent;
  }
  ledger_->resent += sent;
  return sent;
}

int64_t Outbox::count(const std::string& channel) const {
  const auto found = lines_.find(channel);
  return found == lines_.end() ? 0 : found->second.next_sequence;
}

std::vector<ChannelTotal> Outbox::totals() const {
  std::vector<ChannelTotal> totals;
  for (const auto& [channel, line] : lines_) {
    if (!line.hashed) continue;
    totals.push_back({channel, line.next_sequence, line.hash.Digest(), true});
  }
  return totals;
}

void Outbox::Save(std::vector<uint8_t>* out) const {
  Put(out, static_cast<uint32_t>(lines_.size()));
  for (const auto& [channel, line] : lines_) {
    Put(out, static_cast<uint32_t>(channel.size()));
    out->insert(out->end(), channel.begin(), channel.end());
    Put(out, line.next_sequence);
    const size_t at = out->size();
    out->resize(at + StreamHash::kStateBytes);
    line.hash.Save(out->data() + at);
    Put(out, static_cast<uint32_t>(line.kept.size()));
    for (const Kept& kept : line.kept) {
      Put(out, kept.sequence);
      Put(out, kept.tick);
      Put(out, static_cast<uint32_t>(kept.bytes.size()));
      out->insert(out->end(), kept.bytes.begin(), kept.bytes.end());
    }
  }
}

Result<size_t> Outbox::Load(const uint8_t* data, size_t size) {
  SnapshotReader in{data, size};
  lines_.clear();
  const auto num_lines = in.Get<uint32_t>();
  for (uint32_t i = 0; i < num_lines && num_lines <= kMostLines && in.ok; ++i) {
    const auto name_size = in.Get<uint32_t>();
    const uint8_t* name = in.Take(name_size);
    if (!in.ok) break;
    const std::string channel(reinterpret_cast<const char*>(name), name_size);
    if (!ParseChannel(channel)) return Fail("the snapshot names a channel that is none");
    Line& line = LineOf(channel);
    line.next_sequence = in.Get<int64_t>();
    if (const uint8_t* hash = in.Take(StreamHash::kStateBytes)) line.hash.Load(hash);
    const auto num_kept = in.Get<uint32_t>();
    if (num_kept > kMostKept) return Fail("the snapshot keeps too many messages");
    for (uint32_t k = 0; k < num_kept && in.ok; ++k) {
      Kept kept{in.Get<int64_t>(), in.Get<int64_t>(), {}};
      const auto bytes = in.Get<uint32_t>();
      if (const uint8_t* from = in.Take(bytes)) kept.bytes.assign(from, from + bytes);
      line.kept.push_back(std::move(kept));
    }
  }
  if (!in.ok || num_lines > kMostLines) return Fail("the snapshot is cut short or damaged");
  return size - in.left;
}

}  // namespace morphbus::bridge
