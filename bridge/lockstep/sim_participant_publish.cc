// What a SimParticipant says at a tick: CLOCK, SENSORS and WORLD.
#include <algorithm>
#include <morphbus/sensors_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/world_t.hpp>

#include "bridge/lockstep/sim_participant.h"
#include "bridge/wire/vm_codec.h"

namespace morphbus::bridge {
namespace {

using morphbus::sim_clock_t;

/// Announcements a CLOCK carries at most; further ones wait for the next tick.
constexpr size_t kMostControls = 5;

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

void SimParticipant::BeginTick(int64_t tick) {
  // A robot that broke down in the tick before has nothing to tell of this one.
  if (const std::string why = robot_->Breakdown(); !why.empty()) return Refuse(why);
  // Controls take effect before the sensors of the tick are read.
  if (before_tick_) before_tick_(tick);
  // Everybody's readings are of the same moment.
  robot_->Sense(&sensed_);
  robot_->Truth(&truth_);
  robot_->ContactForces(&contacts_);
  if (sense_root_) root_pose_ = sense_root_();
  HideLostModules();
  if (const std::string why = WhyUnusable(); !why.empty()) {
    return Refuse(why + " (tick " + std::to_string(tick) + ")");
  }
  if (sensors_parts_.empty()) {
    // How the messages are split is settled once, for the whole run: listeners count parts.
    std::vector<int> most_docked;
    for (const ExpectedModule& module : options_.modules) {
      most_docked.push_back(module.num_connectors);
    }
    // The parts are laid out for the case that something is docked at every connector.
    sensors_parts_ = SplitSensors(sensed_, most_docked);
    size_t most_links = truth_.size();
    if (!truth_.empty()) {
      // Each joint can come to part two bodies, should connections open, and each link to be
      // touched: the links of a module are a tree, so there is one more than joints.
      size_t links = 0;
      for (const auto& reading : sensed_) links += static_cast<size_t>(reading.num_joints) + 1;
      most_links = std::max(most_links, links);
    }
    const size_t per_part = WorldLinksPerPart();
    world_parts_ = static_cast<int>((most_links + per_part - 1) / per_part);
  }
  // CLOCK goes first, so that listeners know how many parts of the others to expect.
  PublishClock(tick, machine_.started() ? sim_clock_t::PHASE_RUN : sim_clock_t::PHASE_START);
}

void SimParticipant::PublishClock(int64_t tick, int8_t phase) {
  sim_clock_t clock;
  // Listeners that come late learn here what a whole tick consists of.
  clock.phase = phase;
  clock.tick_us = options_.tick_us;
  clock.num_modules = static_cast<int16_t>(options_.modules.size());
  clock.num_sensors_parts = static_cast<int16_t>(sensors_parts_.size());
  clock.num_world_parts = static_cast<int16_t>(world_parts_);
  // The reason says what is known now; the verdict for the logger may know more.
  if (phase == sim_clock_t::PHASE_END) {
    const std::string wrong = refusal_.empty() ? SilentText() : refusal_;
    if (outcome_.reason.empty() && wrong.empty()) outcome_.reason = options_.end_reason;
    if (outcome_.reason.empty()) {
      outcome_.reason = wrong.empty() ? "finished" : CutText(wrong, kLongestText);
      // Whoever reads only how the run ended learns that it was not the whole robot's.
      for (const std::string& gone : GoneModules()) outcome_.reason += ", without " + gone;
      outcome_.reason = CutText(outcome_.reason, kLongestText);
    }
    clock.end_reason = outcome_.reason;
  }
  // Controls that do not fit wait for the next CLOCK; that of tick 0 has none
  // (ControlDesk::BeforeTick).
  const bool first = tick == 0 && phase != sim_clock_t::PHASE_END;
  const size_t controls = first ? 0 : std::min(controls_.size(), kMostControls);
  clock.num_controls = static_cast<int16_t>(controls);
  clock.controls.assign(controls_.begin(),
                        controls_.begin() + static_cast<std::ptrdiff_t>(controls));
  controls_.erase(controls_.begin(), controls_.begin() + static_cast<std::ptrdiff_t>(controls));
  outbox_.Send(channel_clock_, tick, tick * options_.tick_us, &clock);
}

void SimParticipant::PublishSensors(int64_t tick) {
  // One message for all parts and ticks, whose memory is used again and again.
  morphbus::sensors_t& sensors = sensors_message_;
  sensors.num_parts = static_cast<int16_t>(sensors_parts_.size());
  // Each part goes out with the orders for its modules.
  for (size_t part = 0; part < sensors_parts_.size(); ++part) {
    sensors.part = static_cast<int16_t>(part);
    sensors.num_modules = static_cast<int16_t>(sensors_parts_[part].size());
    sensors.modules.resize(sensors_parts_[part].size());
    for (size_t i = 0; i < sensors.modules.size(); ++i) {
      sensors.modules[i] = sensed_[sensors_parts_[part][i]];
    }
    AddOrders(part, tick, &sensors);
    AddRootPose(part, &sensors);
    outbox_.Send(channel_sensors_, tick, tick * options_.tick_us, &sensors);
  }
}

void SimParticipant::AddRootPose(size_t part, morphbus::sensors_t* sensors) const {
  sensors->root_poses.clear();
  const std::vector<size_t>& members = sensors_parts_[part];
  const bool here = sense_root_ && std::any_of(members.begin(), members.end(), [this](size_t i) {
                      return static_cast<int16_t>(options_.modules[i].id) == root_pose_.module_id;
                    });
  if (here) sensors->root_poses.push_back(root_pose_);
  sensors->num_root_poses = static_cast<int8_t>(sensors->root_poses.size());
}

void SimParticipant::RepeatSensors(int64_t tick) {
  // Sequence numbers on CLOCK, SENSORS and WORLD follow from the tick.
  const auto parts = static_cast<int64_t>(sensors_parts_.size());
  if (repeated_tick_ != tick) times_repeated_ = 0;
  repeated_tick_ = tick;
  // At first a module needs all parts, which name all modules, and later only its own; one that has
  // begun anew does not know the names either.
  constexpr int kOwnPartOnly = 4;
  const bool all = tick == 0 || ++times_repeated_ > kOwnPartOnly;
  for (int64_t part = 0; part < parts; ++part) {
    // A tick that all have answered is repeated to show that we are still there.
    const std::vector<size_t>& members = sensors_parts_[static_cast<size_t>(part)];
    const bool needed = all || machine_.AllAnswered() ||
                        std::any_of(members.begin(), members.end(), [this](size_t m) {
                          return !machine_.answered(static_cast<int>(m));
                        });
    if (needed) outbox_.Resend(channel_sensors_, tick * parts + part, tick * parts + part);
  }
}

void SimParticipant::PublishWorld(int64_t tick) {
  morphbus::world_t world;
  world.num_parts = static_cast<int16_t>(world_parts_);
  // Parts beyond the last body and contact are sent empty, since their number is constant.
  for (int part = 0; part < world_parts_; ++part) {
    world.part = static_cast<int16_t>(part);
    world.num_bodies = TakeShare(truth_, part, &world.bodies);
    world.num_contacts = TakeShare(contacts_, part, &world.contacts);
    outbox_.Send(channel_world_, tick, tick * options_.tick_us, &world);
  }
}

}  // namespace morphbus::bridge
