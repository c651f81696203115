#include "bridge/lockstep/taken_ledger.h"

#include <utility>

#include "bridge/lockstep/snapshot_bytes.h"
#include "bridge/wire/channels.h"

namespace morphbus::bridge {
namespace {

/// An entry of a report.
morphbus::taken_total_t Entry(std::string channel, int64_t part, const std::string& taker,
                              const TakenSum& what) {
  morphbus::taken_total_t entry;
  entry.channel = std::move(channel);
  entry.part = static_cast<int16_t>(part);
  entry.taker = taker;
  entry.count = what.count;
  entry.sum = static_cast<int64_t>(what.sum);
  return entry;
}

}  // namespace

void TakenLedger::TakeSensors(int64_t tick, int part, uint64_t digest) {
  // Which part a module is in never changes during a run.
  part_ = part;
  sensors_.Add(digest);
  recent_sensors_.Add(tick, digest);
}

void TakenLedger::TakeTransform(int64_t tick, const std::string& mate, uint64_t digest) {
  Mate* const of = Of(mate);
  of->taken.Add(digest);
  of->recent.Add(tick, digest);
}

TakenLedger::Mate* TakenLedger::Of(const std::string& mate) {
  // No module can be called by an empty name.
  const bool known = mates_.contains(mate);
  return &mates_[known || mates_.size() < kMostMates ? mate : std::string()];
}

std::vector<morphbus::taken_total_t> TakenLedger::Report(const std::string& run,
                                                         const std::string& module) const {
  std::vector<morphbus::taken_total_t> report;
  const auto add = [&](const std::string& channel, int64_t part, const std::string& taker,
                       const TakenSum& what) {
    report.push_back(Entry(channel, part, taker, what));
  };
  // A channel of which nothing was taken is left out, as the other side leaves it out.
  if (sensors_.count > 0) {
    add(Channel(run, kSimProcess, Topic::kSensors), part_, module, sensors_);
  }
  for (const auto& [name, mate] : mates_) {
    if (mate.taken.count > 0) add(Channel(run, name, Topic::kTransform), -1, module, mate.taken);
    if (mate.given.count > 0) add(Channel(run, module, Topic::kTransform), -1, name, mate.given);
  }
  return report;
}

std::vector<morphbus::taken_total_t> TakenLedger::Recent(const std::string& run,
                                                         const std::string& module,
                                                         int64_t first) const {
  std::vector<morphbus::taken_total_t> report;
  const TakenSum sensors = recent_sensors_.Of(first);
  if (sensors.count > 0) {
    report.push_back(Entry(Channel(run, kSimProcess, Topic::kSensors), part_, module, sensors));
  }
  for (const auto& [name, mate] : mates_) {
    const TakenSum taken = mate.recent.Of(first);
    // Those beyond kMostMates share an entry without a name.
    if (taken.count == 0 || name.empty()) continue;
    report.push_back(Entry(Channel(run, name, Topic::kTransform), -1, module, taken));
  }
  return report;
}

void TakenLedger::Save(std::vector<uint8_t>* out) const {
  // Load() reads the same in the same order.
  PutBytes(out, part_);
  PutBytes(out, sensors_);
  PutBytes(out, recent_sensors_);
  PutBytes(out, own_transform_);
  PutBytes(out, static_cast<uint32_t>(mates_.size()));
  for (const auto& [name, mate] : mates_) {
    PutText(out, name);
    PutBytes(out, mate);
  }
}

Result<size_t> TakenLedger::Load(const uint8_t* data, size_t size) {
  SnapshotReader in{data, size};
  part_ = in.Get<int64_t>();
  sensors_ = in.Get<TakenSum>();
  recent_sensors_ = in.Get<TakenBlocks>();
  own_transform_ = in.Get<uint64_t>();
  const auto num_mates = in.Get<uint32_t>();
  mates_.clear();
  // The count is believed only as long as there are bytes.
  for (uint32_t i = 0; i < num_mates && in.ok; ++i) {
    const std::string name = in.GetText();
    mates_[name] = in.Get<Mate>();
  }
  if (!in.ok) return Fail("the snapshot is cut short or damaged");
  return size - in.left;
}

}  // namespace morphbus::bridge
