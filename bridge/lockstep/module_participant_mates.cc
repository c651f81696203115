// Whom a ModuleParticipant knows and listens to: the names of all modules, by the SENSORS of the
// first ticks, and the TRANSFORM of those that are mated to it.

#include <algorithm>
#include <iterator>
#include <morphbus/sensors_t.hpp>
#include <morphbus/transform_t.hpp>
#include <string>
#include <utility>

#include "bridge/lockstep/module_participant.h"
#include "bridge/lockstep/module_scratch.h"
#include "bridge/wire/own_sensors.h"
#include "bridge/wire/wire_peek.h"
#include "bridge/wire/wire_size.h"

namespace morphbus::bridge {
namespace {

/// A neighbour sends TRANSFORM before the sim can go on, so it is there when SENSORS comes.
constexpr Interest kTransformInterest{false, 0, 0, 0, false};

/// Modules that are listened to: far more than a robot has, as with names.
constexpr size_t kMostMailboxes = 4 * vm::kMaxNeighbours;

/// Messages that are kept until it is known who the neighbours are; what else comes is asked for.
constexpr size_t kMostEarlyMates = 4096;

}  // namespace

void ModuleParticipant::ListenToAllMates() {
  // Who our neighbours are SENSORS will tell, and by then a fast one may have answered tick 0.
  listens_to_all_ = true;
  bus_->SubscribeQuietly(
      options_.run + "/", "/" + std::string(TopicName(Topic::kTransform)),
      [this](std::string_view channel, const uint8_t* data, size_t size) {
        // Counted as received when it is taken, if it ever is.
        if (!Check<morphbus::transform_t>(data, size, {options_.model_hash, 0})) {
          ++ledger_.bad;
          return;
        }
        if (early_.size() >= kMostEarlyMates || size > kMaxPayloadBytes) return;
        early_.try_emplace(std::string(channel), data, data + size);
      });
}

void ModuleParticipant::TakeEarly(uint16_t mate) {
  const auto early = early_.extract(ChannelOf(mailboxes_[mate].name, Topic::kTransform));
  if (!early.empty()) OnTransform(mate, early.mapped().data(), early.mapped().size());
}

bool ModuleParticipant::TakeKnownPart(const uint8_t* data, size_t size) {
  const NameDirectory::Part* part = directory_->PartOf(MessageDigest(data, size));
  if (part == nullptr || std::ranges::binary_search(part->modules, options_.module_id))
    return false;
  ++ledger_.received;
  std::vector<uint16_t>& mates = scratch_.sensed_mates;
  mates.clear();
  if (SensorsFit(part->tick)) {
    machine_.OnSensors(part->tick, part->part, part->num_parts, false, mates, now_us(), &actions_);
    // It may be the one that names a neighbour.
    TakeMates(input_, &mates);
    UpdateSubscriptions(mates, false);
  }
  CarryOutActions();
  return true;
}

void ModuleParticipant::LearnNames(const uint8_t* data, size_t size) {
  const morphbus::sensors_t& sensors = scratch_.sensors;
  NameDirectory::Part part{sensors.header.tick, sensors.part, sensors.num_parts, {}};
  PeekReadings(data, [&](const PeekedReading& reading) {
    directory_->Add(reading.module_id, reading.name);
    part.modules.push_back(reading.module_id);
  });
  std::ranges::sort(part.modules);
  directory_->AddPart(MessageDigest(data, size), std::move(part));
}

void ModuleParticipant::UpdateSubscriptions(const std::vector<uint16_t>& mates, bool own_part) {
  const SubscriptionBatch together(bus_);
  // Neighbours come and go; whoever is not mated any more makes room.
  if (mailboxes_.size() >= kMostMailboxes) ForgetAllBut(mates);
  for (const uint16_t mate : mates) Watch(mate);
  if (own_part) NarrowSensors(scratch_.sensors.part);
  // From here on neighbours are listened to by name.
  if (machine_.tick() > 0 && listens_to_all_) {
    listens_to_all_ = false;
    early_.clear();
    bus_->Unsubscribe(options_.run + "/");
  }
}

void ModuleParticipant::NarrowSensors(int16_t part) {
  if (narrowed_ || !machine_.knows_all()) return;
  narrowed_ = true;
  // Every module's name is known by now; our own part is enough.
  const Interest own{true, 2, kFirstFieldOffset, static_cast<uint16_t>(part), false};
  ListenFor(own, ChannelOf(kSimProcess, Topic::kSensors), &ModuleParticipant::OnSensors);
}

void ModuleParticipant::ForgetAllBut(const std::vector<uint16_t>& mates) {
  for (auto it = mailboxes_.begin(); it != mailboxes_.end();) {
    const bool mated = std::find(mates.begin(), mates.end(), it->first) != mates.end();
    if (!mated) bus_->Unsubscribe(Channel(options_.run, it->second.name, Topic::kTransform));
    it = mated ? std::next(it) : mailboxes_.erase(it);
  }
}

void ModuleParticipant::TakeMates(const vm::TickInput& input, std::vector<uint16_t>* mates) {
  for (int c = 0; c < options_.num_connectors; ++c) {
    const vm::ConnectorReading& connector = input.connectors[c];
    if (!connector.docked || connector.mate_module == options_.module_id) continue;
    // Several connectors may be mated to the same module.
    const bool known =
        std::find(mates->begin(), mates->end(), connector.mate_module) != mates->end();
    if (!known) mates->push_back(connector.mate_module);
  }
}

void ModuleParticipant::Watch(uint16_t mate) {
  if (mailboxes_.contains(mate)) return;
  const std::string* name = directory_->NameOf(mate);
  if (name == nullptr) return;
  // From now on this neighbour's messages are received.
  mailboxes_[mate].name = *name;
  ListenFor(kTransformInterest, ChannelOf(*name, Topic::kTransform),
            &ModuleParticipant::OnTransform, mate);
  TakeEarly(mate);
}

}  // namespace morphbus::bridge
