#include "bridge/lockstep/sim/tick_publisher.h"

#include <algorithm>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/world_t.hpp>

#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/vm_codec.h"

namespace morphbus::bridge {
namespace {

using morphbus::sim_clock_t;

/// The entries of a list that part number `part` of WORLD holds, and how many they are.
template <class Entry>
int16_t TakeShare(const std::vector<Entry>& all, int part, std::vector<Entry>* share) {
  const size_t per_part = WorldLinksPerPart();
  const size_t from = std::min(all.size(), static_cast<size_t>(part) * per_part);
  const size_t to = std::min(all.size(), from + per_part);
  share->assign(all.begin() + static_cast<std::ptrdiff_t>(from),
                all.begin() + static_cast<std::ptrdiff_t>(to));
  return static_cast<int16_t>(to - from);
}

}  // namespace

TickPublisher::TickPublisher(Outbox* outbox, const std::vector<ExpectedModule>& modules,
                             int32_t tick_us)
    : outbox_(outbox), tick_us_(tick_us) {
  const std::string& run = outbox->sender().run;
  clock_ = Channel(run, kSimProcess, Topic::kClock);
  sensors_ = Channel(run, kSimProcess, Topic::kSensors);
  world_ = Channel(run, kSimProcess, Topic::kWorld);
  for (const ExpectedModule& module : modules) num_connectors_.push_back(module.num_connectors);
}

void TickPublisher::Announce(const std::string& text) {
  // With a longer text receivers would refuse the whole CLOCK.
  announcements_.push_back(CutText(text, kLongestText));
}

void TickPublisher::Split(const RobotReadings& readings) {
  // The parts are laid out for the case that something is docked at every connector.
  sensors_parts_ = SplitSensors(readings.modules(), num_connectors_);
  size_t most_links = readings.bodies().size();
  if (most_links > 0) {
    // Each joint can come to part two bodies, should connections open, and each link to be touched:
    // the links of a module are a tree, so there is one more than joints.
    size_t links = 0;
    for (const auto& reading : readings.modules()) {
      links += static_cast<size_t>(reading.num_joints) + 1;
    }
    most_links = std::max(most_links, links);
  }
  const size_t per_part = WorldLinksPerPart();
  world_parts_ = static_cast<int>((most_links + per_part - 1) / per_part);
}

void TickPublisher::PublishClock(int64_t tick, bool started, const RobotReadings& readings) {
  if (sensors_parts_.empty()) Split(readings);
  SendClock(tick, started ? sim_clock_t::PHASE_RUN : sim_clock_t::PHASE_START, "");
}

void TickPublisher::PublishEnd(int64_t tick, const std::string& reason) {
  SendClock(tick, sim_clock_t::PHASE_END, reason);
}

void TickPublisher::SendClock(int64_t tick, int8_t phase, const std::string& end_reason) {
  sim_clock_t clock;
  // Listeners that come late learn here what a whole tick consists of.
  clock.phase = phase;
  clock.tick_us = tick_us_;
  clock.num_modules = static_cast<int16_t>(num_connectors_.size());
  clock.num_sensors_parts = static_cast<int16_t>(sensors_parts_.size());
  clock.num_world_parts = static_cast<int16_t>(world_parts_);
  clock.end_reason = end_reason;
  // Tick 0 is the robot as it was built: controls wait for the next one (ControlDesk::BeforeTick).
  const bool first = tick == 0 && phase != sim_clock_t::PHASE_END;
  const size_t carried = first ? 0 : std::min(announcements_.size(), kMostAnnounced);
  const auto end = announcements_.begin() + static_cast<std::ptrdiff_t>(carried);
  clock.num_controls = static_cast<int16_t>(carried);
  clock.controls.assign(announcements_.begin(), end);
  announcements_.erase(announcements_.begin(), end);
  outbox_->Send(clock_, tick, TimeOf(tick), &clock);
}

void TickPublisher::PublishReadings(
    int64_t tick, const RobotReadings& readings,
    const std::function<void(const std::vector<size_t>& members, morphbus::sensors_t* part)>&
        add_orders) {
  message_.num_parts = static_cast<int16_t>(sensors_parts_.size());
  // Every module is in the same part in each tick, so that it need not read the others.
  for (size_t part = 0; part < sensors_parts_.size(); ++part) {
    const std::vector<size_t>& members = sensors_parts_[part];
    message_.part = static_cast<int16_t>(part);
    message_.num_modules = static_cast<int16_t>(members.size());
    message_.modules.resize(members.size());
    message_.root_poses.clear();
    for (size_t i = 0; i < members.size(); ++i) {
      message_.modules[i] = readings.modules()[members[i]];
      // The root gets its measured pose with its own reading.
      const auto& pose = readings.root_pose();
      if (pose && pose->module_id == message_.modules[i].module_id) {
        message_.root_poses.push_back(*pose);
      }
    }
    message_.num_root_poses = static_cast<int8_t>(message_.root_poses.size());
    add_orders(members, &message_);
    outbox_->Send(sensors_, tick, TimeOf(tick), &message_);
  }
  morphbus::world_t world;
  world.num_parts = static_cast<int16_t>(world_parts_);
  // Parts beyond the last body and contact are sent empty, since their number is constant.
  for (int part = 0; part < world_parts_; ++part) {
    world.part = static_cast<int16_t>(part);
    world.num_bodies = TakeShare(readings.bodies(), part, &world.bodies);
    world.num_contacts = TakeShare(readings.contacts(), part, &world.contacts);
    outbox_->Send(world_, tick, TimeOf(tick), &world);
  }
}

void TickPublisher::RepeatClock(int64_t tick) {
  // Numbers on CLOCK, SENSORS and WORLD follow from the tick.
  outbox_->Resend(clock_, tick, tick);
}

void TickPublisher::RepeatEnd() {
  // END is the last CLOCK, whatever its tick.
  const int64_t last = outbox_->count(clock_) - 1;
  outbox_->Resend(clock_, last, last);
}

void TickPublisher::RepeatSensors(int64_t tick, const std::function<bool(size_t module)>& lacks) {
  if (repeated_tick_ != tick) times_repeated_ = 0;
  repeated_tick_ = tick;
  // At first a module needs all parts, which name all modules, and later only its own; one that has
  // begun anew does not know the names either.
  constexpr int kOwnPartOnly = 4;
  const bool all = tick == 0 || ++times_repeated_ > kOwnPartOnly;
  const auto parts = static_cast<int64_t>(sensors_parts_.size());
  for (int64_t part = 0; part < parts; ++part) {
    // A part of which all modules have what they need is not sent again.
    if (!all && std::ranges::none_of(sensors_parts_[part], lacks)) continue;
    outbox_->Resend(sensors_, tick * parts + part, tick * parts + part);
  }
}

}  // namespace morphbus::bridge
