#include "bridge/lockstep/module_participant.h"

#include <algorithm>
#include <cstring>
#include <morphbus/actuator_t.hpp>
#include <morphbus/hello_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <utility>

#include "bridge/lockstep/module_scratch.h"
#include "bridge/wire/own_sensors.h"
#include "bridge/wire/sealed_bus.h"
#include "bridge/wire/vm_codec.h"
#include "bridge/wire/wire_peek.h"
#include "bridge/wire/wire_size.h"

namespace morphbus::bridge {
namespace {

/// Of CLOCK a module needs the beginning and the end: in between SENSORS is its beat.
constexpr Interest kClockInterest{true, 1, kFirstFieldOffset, morphbus::sim_clock_t::PHASE_RUN,
                                  true};

/// In real time a mate's message this many ticks old is still better than none.
constexpr int64_t kOldestUseful = 3;

/// First bytes of a snapshot. It says whose state follows, so that another module's or build's is
/// refused.
struct SnapshotHead {
  uint64_t magic = 0x4d42534e41503031;  // "MBSNAP01"
  int64_t next_tick = 0;
  int64_t claim = 0;
  uint64_t program_hash = 0;
  uint64_t kinematics_hash = 0;
  uint64_t state_size = 0;
  uint32_t incarnation = 0;
  uint16_t module_id = 0;
  uint8_t left = 0;  ///< 1: it was told that the run goes on without it.
  uint8_t unused = 0;
};

}  // namespace

ModuleParticipant::ModuleParticipant(Bus* bus, ModuleController* controller, const TimeSource* time,
                                     ModuleParticipantOptions options)
    : LockstepParticipant(bus, time,
                          {options.run, options.module, options.model_hash, options.program_hash},
                          options),
      controller_(controller),
      options_(std::move(options)),
      channel_transform_(Channel(options_.run, options_.module, Topic::kTransform)),
      channel_actuator_(Channel(options_.run, options_.module, Topic::kActuator)),
      channel_status_(Channel(options_.run, options_.module, Topic::kStatus)),
      directory_(options_.names != nullptr ? options_.names : std::make_shared<NameDirectory>()),
      scratch_(Scratch::OfThread()) {
  ledger_.restarts = options_.restarts;
}

void ModuleParticipant::WriteSnapshot(int64_t next_tick) {
  if (!before_publish_) return;
  SnapshotHead head;
  head.next_tick = next_tick;
  head.claim = options_.claim;
  head.program_hash = options_.program_hash;
  head.kinematics_hash = options_.kinematics_hash;
  head.incarnation = options_.incarnation;
  head.module_id = options_.module_id;
  head.left = left_ ? 1 : 0;
  // Head, state of the virtual machine, and everything that was sent and is still kept.
  snapshot_.resize(sizeof head);
  controller_->Save(&snapshot_);
  head.state_size = snapshot_.size() - sizeof head;
  std::memcpy(snapshot_.data(), &head, sizeof head);
  outbox_.Save(&snapshot_);
  before_publish_(snapshot_);
}

Result<void> ModuleParticipant::ResumeFrom(const std::vector<uint8_t>& snapshot) {
  SnapshotHead head;
  const uint64_t magic = head.magic;
  if (snapshot.size() < sizeof head) return Fail("the snapshot is cut short");
  std::memcpy(&head, snapshot.data(), sizeof head);
  // The head says whether the rest can be read at all.
  if (head.magic != magic) return Fail("the snapshot is not one of this build");
  if (head.program_hash != options_.program_hash ||
      head.kinematics_hash != options_.kinematics_hash || head.module_id != options_.module_id) {
    return Fail("the snapshot is of another module, program or build");
  }
  if (head.state_size > snapshot.size() - sizeof head) return Fail("the snapshot is cut short");
  // The controller's state lies between head and outbox.
  const size_t state_end = sizeof head + head.state_size;
  const Result<size_t> used =
      outbox_.Load(snapshot.data() + state_end, snapshot.size() - state_end);
  if (!used) return tl::unexpected<Error>(used.error());
  // A later incarnation knows nothing of what an earlier one knew, but what has been said stays so.
  const bool anew = options_.incarnation > head.incarnation;
  if (!anew && !controller_->Load(snapshot.data() + sizeof head, head.state_size)) {
    return Fail("the snapshot is of another build");
  }
  // The resumed process speaks as the one that was killed, so the sim sees no second claimant.
  options_.claim = head.claim;
  options_.incarnation = std::max(options_.incarnation, head.incarnation);
  resume_tick_ = head.next_tick;
  resumed_ = true;
  left_ = head.left != 0;
  return {};
}

void ModuleParticipant::Start() {
  // The place of one that left nothing behind is taken once the sim tells which tick comes next.
  const bool takes_place = options_.incarnation > 1 && !resumed_;
  {
    const SubscriptionBatch together(bus_);
    ListenFor(kClockInterest, ChannelOf(kSimProcess, Topic::kClock), &ModuleParticipant::OnClock);
    Listen(ChannelOf(kSimProcess, Topic::kSensors), &ModuleParticipant::OnSensors);
    Listen(ChannelOf(kSimProcess, Topic::kLeave), &ModuleParticipant::OnLeave);
    Listen(ChannelOf(options_.module, Topic::kResend), &ModuleParticipant::OnResend);
    if (takes_place) Listen(ChannelOf(kSimProcess, Topic::kAdmit), &ModuleParticipant::OnAdmit);
    if (!takes_place && resume_tick_ == 0) ListenToAllMates();
  }
  if (takes_place) return Tell(&ModuleLockstep::Begin, ModuleLockstep::kUnknownTick);
  // A process that is killed before its next answer resumes from here, in the same incarnation.
  WriteSnapshot(resume_tick_);
  Tell(&ModuleLockstep::Begin, resume_tick_);
  if (!left_) return;
  machine_.OnLeave(now_us(), &actions_);
  CarryOutActions();
}

void ModuleParticipant::OnTime() {
  LockstepParticipant::OnTime();
  if (machine_.waits_for_mates() == wakes_for_any_) return;
  wakes_for_any_ = !wakes_for_any_;
  bus_->WakeForAny(wakes_for_any_);
}

void ModuleParticipant::OnClock(const uint8_t* data, size_t size) {
  morphbus::sim_clock_t clock;
  if (!Accept(data, size, &clock)) return;
  if (clock.phase == morphbus::sim_clock_t::PHASE_END) end_reason_ = clock.end_reason;
  Tell(&ModuleLockstep::OnClock, clock.header.tick, static_cast<int>(clock.phase));
}

bool ModuleParticipant::SensorsFit(int64_t tick) {
  if (machine_.InWindow(tick)) return true;
  // Once the run goes on without us, what comes is for others.
  if (machine_.left()) return false;
  CountRefused(&Ledger::outside_window, "SIM/SENSORS",
               "tick " + std::to_string(tick) + " in tick " + std::to_string(machine_.tick()));
  return false;
}

void ModuleParticipant::OnSensors(const uint8_t* data, size_t size) {
  if (!narrowed_ && TakeKnownPart(data, size)) return;
  // SENSORS holds many modules' readings: we take our own.
  morphbus::sensors_t& sensors = scratch_.sensors;
  const Expectation expect{options_.model_hash, 0};
  const bool sound = DecodeOwnSensors(data, size, expect, options_.module_id, &sensors).has_value();
  ++(sound ? ledger_.received : ledger_.bad);
  if (!sound) return;
  const int64_t tick = sensors.header.tick;
  if (!SensorsFit(tick)) {
    // Nothing is kept of it; but the run may have another process in our place.
    Tell(&ModuleLockstep::OnSensors, tick, sensors.part, sensors.num_parts, false,
         std::vector<uint16_t>());
    return;
  }
  // Once the names of all are known nothing more is looked for in the others' readings.
  if (!narrowed_) LearnNames(data, size);
  const morphbus::module_sensors_t* mine =
      sensors.modules.empty() ? nullptr : &sensors.modules.front();
  std::vector<uint16_t>& mates = scratch_.sensed_mates;
  mates.clear();
  if (mine != nullptr) {
    // Of the parts only ours is needed for good, so its ticks are counted.
    const uint64_t digest = MessageDigest(data, size);
    // What cannot be ours takes nobody's place. A reading for the tick to come is taken over before
    // the machine may ask for its computation.
    vm::TickInput input;
    if (!ReadingFits(*mine, &input)) {
      ++ledger_.bad;
      return;
    }
    if (!Track(&sensors_tracker_, "SIM/SENSORS", tick, digest)) return;
    if (tick >= machine_.tick()) TakeReading(input, &mates);
  }
  if (options_.realtime || tick == machine_.tick()) sim_time_us_ = sensors.header.sim_time_us;
  // The machine learns which parts have come and whom the tick waits for.
  machine_.OnSensors(tick, sensors.part, sensors.num_parts, mine != nullptr, mates, now_us(),
                     &actions_);
  // Another part than ours may be the one that names a neighbour.
  if (!narrowed_ && mine == nullptr) TakeMates(input_, &mates);
  UpdateSubscriptions(mates, mine != nullptr);
  CarryOutActions();
}

bool ModuleParticipant::ReadingFits(const morphbus::module_sensors_t& mine,
                                    vm::TickInput* input) const {
  return mine.name == options_.module &&
         FromSensors(mine, options_.num_joints, options_.num_connectors, options_.num_sensor_values,
                     input);
}

void ModuleParticipant::TakeReading(const vm::TickInput& input, std::vector<uint16_t>* mates) {
  TakeMates(input, mates);
  input_ = input;
  TakeOrders();
}

/// What SENSORS tells this module besides its own reading: orders, and where the root is.
void ModuleParticipant::TakeOrders() {
  // Orders of the last tick are done with.
  pieces_.clear();
  for (const morphbus::invoke_request_t& request : scratch_.sensors.requests) {
    if (static_cast<uint16_t>(request.module_id) != options_.module_id) continue;
    FromRequest(request, &input_.requests[input_.num_requests++]);
  }
  for (const morphbus::deploy_piece_t& piece : scratch_.sensors.pieces) {
    if (static_cast<uint16_t>(piece.module_id) == options_.module_id) pieces_.push_back(piece);
  }
  for (const morphbus::root_pose_t& pose : scratch_.sensors.root_poses) {
    if (static_cast<uint16_t>(pose.module_id) == options_.module_id) FromRootPose(pose, &input_);
  }
  inspected_ = inspected_ || IsInspected(scratch_.sensors, options_.module_id);
}

void ModuleParticipant::OnTransform(uint16_t mate, const uint8_t* data, size_t size) {
  morphbus::transform_t& transform = scratch_.transform;
  const auto fits = [&] { return static_cast<uint16_t>(transform.module_id) == mate; };
  const auto found = mailboxes_.find(mate);
  // Where a thousand modules share a process, the mailbox is mostly not in the processor's cache:
  // it is fetched while the message is decoded.
  if (found != mailboxes_.end()) found->second.tracker.FetchNext();
  if (!Accept(data, size, &transform, fits)) return;
  if (found == mailboxes_.end()) return;
  Mailbox& mailbox = found->second;
  const std::string channel = mailbox.name + "/TRANSFORM";
  const int64_t tick = transform.header.tick;
  // In lockstep the number is the tick.
  if (!machine_.InWindow(tick) || (!options_.realtime && transform.header.sequence != tick)) {
    if (machine_.left()) return;
    return CountRefused(
        &Ledger::outside_window, channel,
        "tick " + std::to_string(tick) + " in tick " + std::to_string(machine_.tick()));
  }
  const uint64_t digest = MessageDigest(data, size);
  if (!Track(&mailbox.tracker, channel, transform.header.sequence, digest)) return;
  // The machine may compute at once: the content must be in place before it hears of it.
  const auto slot = static_cast<size_t>(tick & 1);
  const bool useful = options_.realtime || tick == machine_.tick() || tick == machine_.tick() - 1;
  if (useful && mailbox.ticks[slot] < tick) {
    FromTransform(transform, &mailbox.messages[slot]);
    mailbox.ticks[slot] = tick;
  }
  Tell(&ModuleLockstep::OnTransform, mate, tick);
}

void ModuleParticipant::CarryOut(const ModuleAction& action) {
  switch (action.kind) {
    case ModuleAction::Kind::kHello:
      return SayHello(options_.claim, options_.build, options_.incarnation, options_.type_name,
                      options_.kinematics_hash);
    case ModuleAction::Kind::kCompute:
      return Compute(action.tick);
    // In lockstep a TRANSFORM's number is its tick.
    case ModuleAction::Kind::kAskMate:
      if (const std::string* name = directory_->NameOf(action.mate); name != nullptr) {
        AskForResend(*name, Topic::kTransform, action.tick, action.tick);
      }
      return;
    // The sim makes the run's hash of its own totals and of those that modules send here.
    case ModuleAction::Kind::kEndAck:
      return SayTotals(machine_.tick() - 1, outbox_.totals());
    case ModuleAction::Kind::kFinish:
      return;
    // Neither of these is the run's own end, so both are errors of this process.
    case ModuleAction::Kind::kDuplicateProcess:
      error_ = "the run '" + options_.run + "' is already at tick " + std::to_string(action.tick) +
               ", and nothing of tick " + std::to_string(machine_.tick()) +
               " is heard any more: it has another " + options_.module;
      return;
    case ModuleAction::Kind::kLostSim:
      error_ = "nothing heard from the simulator of run '" + options_.run + "' any more" +
               UnauthenticText(bus_->unauthentic());
      return;
  }
}

const vm::NeighbourMessage* ModuleParticipant::MessageOf(uint16_t mate, int64_t tick) {
  const auto found = mailboxes_.find(mate);
  if (found == mailboxes_.end()) return nullptr;
  const Mailbox& mailbox = found->second;
  const auto slot = static_cast<size_t>(tick & 1);
  if (mailbox.ticks[slot] == tick) return &mailbox.messages[slot];
  // In real time an older message is better than none, for a while.
  if (!options_.realtime) return nullptr;
  ++ledger_.missed_deadlines;
  const size_t newest = mailbox.ticks[0] > mailbox.ticks[1] ? 0 : 1;
  return mailbox.ticks[newest] >= tick - kOldestUseful ? &mailbox.messages[newest] : nullptr;
}

void ModuleParticipant::Compute(int64_t tick) {
  // The tick's input: sensors, and what each neighbour said a tick ago.
  input_.tick = tick;
  input_.sim_time_us = sim_time_us_;
  for (int c = 0; c < options_.num_connectors; ++c) {
    const vm::ConnectorReading& connector = input_.connectors[c];
    const bool mate = connector.docked && connector.mate_module != options_.module_id && tick > 0;
    input_.messages[c] = mate ? MessageOf(connector.mate_module, tick - 1) : nullptr;
  }
  // New programs are taken before the tick that they came with is computed.
  for (const morphbus::deploy_piece_t& piece : pieces_) controller_->TakePiece(piece);
  controller_->Tick(input_, &scratch_.output);
  Publish(tick);
}

void ModuleParticipant::Publish(int64_t tick) {
  const vm::TickOutput& output = scratch_.output;
  // What is published must be saved first, so it is held back meanwhile.
  if (before_publish_) outbox_.Hold();
  // A program that was replaced in this tick shows in the headers from this tick on.
  outbox_.SetProgramHash(output.message.program_hash);
  // STATUS only when it says something new or is asked for, and now and then for those who came
  // later. An order holds for one tick, also in real time, where readings may fail to come.
  const bool inspected = std::exchange(inspected_, false);
  if (output.status.changed || inspected || tick % kStatusEveryTicks == 0) {
    for (morphbus::status_t& status : controller_->Describe(output.status, inspected)) {
      outbox_.Send(&channel_status_, tick, sim_time_us_, &status);
    }
  }
  // Neighbours need TRANSFORM for their next tick.
  ToTransform(output.message, &scratch_.transform);
  outbox_.Send(&channel_transform_, tick, sim_time_us_, &scratch_.transform);
  // Last, because the sim goes on once it has this.
  morphbus::actuator_t actuator;
  ToActuator(output, options_.module_id, options_.num_joints, outbox_.count(channel_status_),
             &actuator);
  outbox_.Send(&channel_actuator_, tick, sim_time_us_, &actuator);
  if (!before_publish_) return;
  // Saved, then sent: whoever is killed in between sends the same bytes again.
  WriteSnapshot(tick + 1);
  outbox_.Release();
}

}  // namespace morphbus::bridge
