#include "bridge/lockstep/module_participant.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <morphbus/actuator_t.hpp>
#include <morphbus/ask_t.hpp>
#include <morphbus/hello_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <utility>

#include "bridge/wire/vm_codec.h"
#include "bridge/wire/wire_size.h"

namespace morphbus::bridge {
namespace {

using Kind = ModuleAction::Kind;
using morphbus::ask_t;

/// Of CLOCK a module needs the beginning and the end: in between SENSORS is its beat.
constexpr Interest kClockInterest{true, 1, kFirstFieldOffset, morphbus::sim_clock_t::PHASE_RUN,
                                  true};

/// A neighbour sends TRANSFORM before the sim can go on, so it is there when SENSORS comes.
constexpr Interest kTransformInterest{false, 0, 0, 0, false};

/// In real time a mate's message this many ticks old is still better than none.
constexpr int64_t kOldestUseful = 3;

/// Names of modules that are remembered, and modules that are listened to: far more than a robot
/// has, so that only messages made up in bad faith ever meet these limits.
constexpr size_t kMostNames = 4096;
constexpr size_t kMostMailboxes = 4 * vm::kMaxNeighbours;

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
  uint16_t padding = 0;
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
      channel_status_(Channel(options_.run, options_.module, Topic::kStatus)) {}

void ModuleParticipant::WriteSnapshot(int64_t next_tick) {
  if (!before_publish_) return;
  SnapshotHead head;
  head.next_tick = next_tick;
  head.claim = options_.claim;
  head.program_hash = options_.program_hash;
  head.kinematics_hash = options_.kinematics_hash;
  head.incarnation = options_.incarnation;
  head.module_id = options_.module_id;
  // Head, state of the virtual machine, then everything that was sent and is still kept.
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
  if (!controller_->Load(snapshot.data() + sizeof head, head.state_size)) {
    return Fail("the snapshot is of another build");
  }
  // The resumed process speaks as the one that was killed, so the sim sees no second claimant.
  options_.claim = head.claim;
  options_.incarnation = head.incarnation;
  resume_tick_ = head.next_tick;
  return {};
}

void ModuleParticipant::Start() {
  ListenFor(kClockInterest, ChannelOf(kSimProcess, Topic::kClock), &ModuleParticipant::OnClock);
  Listen(ChannelOf(kSimProcess, Topic::kSensors), &ModuleParticipant::OnSensors);
  Listen(ChannelOf(options_.module, Topic::kAsk), &ModuleParticipant::OnAsk);
  // A process that is killed before its first answer resumes from its very beginning.
  if (resume_tick_ == 0) WriteSnapshot(0);
  Tell(&ModuleLockstep::Begin, resume_tick_);
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
  Tell(&ModuleLockstep::OnClock, clock.header.tick, clock.phase);
}

void ModuleParticipant::OnSensors(const uint8_t* data, size_t size) {
  if (!Accept(data, size, &sensors_)) return;
  const int64_t tick = sensors_.header.tick;
  // SENSORS holds all modules' readings: we take our own, and the others' names.
  const morphbus::module_sensors_t* mine = nullptr;
  for (const morphbus::module_sensors_t& reading : sensors_.modules) {
    const auto id = static_cast<uint16_t>(reading.module_id);
    if (id == options_.module_id) mine = &reading;
    // Names are told once and stay: a message that tells another one later is not believed.
    if (directory_.size() < kMostNames && CheckModuleName(reading.name)) {
      directory_.try_emplace(id, reading.name);
    }
  }
  std::vector<uint16_t> mates;
  // A reading for the tick to come is taken over before the machine may ask for its computation.
  if (mine != nullptr && tick >= machine_.tick()) {
    vm::TickInput input;
    if (mine->name != options_.module ||
        !FromSensors(*mine, options_.num_joints, options_.num_connectors, &input)) {
      ++ledger_.bad;
      return;
    }
    TakeMates(input, &mates);
    if (tick == machine_.tick() || options_.realtime) {
      input_ = input;
      TakeOrders();
    }
  }
  if (options_.realtime || tick == machine_.tick()) sim_time_us_ = sensors_.header.sim_time_us;
  // The machine learns which parts have come and whom the tick waits for.
  machine_.OnSensors(tick, sensors_.part, sensors_.num_parts, mine != nullptr, mates, now_us(),
                     &actions_);
  if (mine != nullptr) {
    // Of the parts only ours is needed for good, so its ticks are counted.
    trackers_["SENSORS"].Take(tick, &ledger_);
    NarrowSensors(sensors_.part);
  }
  // Neighbours come and go; whoever is not mated any more makes room.
  if (mailboxes_.size() >= kMostMailboxes) ForgetAllBut(mates);
  for (const uint16_t mate : mates) Watch(mate);
  CarryOutActions();
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

/// What SENSORS asks of this module besides telling it what it senses.
void ModuleParticipant::TakeOrders() {
  // Orders of the last tick are done with.
  pieces_.clear();
  for (const morphbus::invoke_request_t& request : sensors_.requests) {
    if (static_cast<uint16_t>(request.module_id) != options_.module_id) continue;
    FromRequest(request, &input_.requests[input_.num_requests++]);
  }
  for (const morphbus::deploy_piece_t& piece : sensors_.pieces) {
    if (static_cast<uint16_t>(piece.module_id) == options_.module_id) pieces_.push_back(piece);
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
  const auto name = directory_.find(mate);
  if (name == directory_.end() || mailboxes_.contains(mate)) return;
  // From now on this neighbour's messages are received.
  mailboxes_[mate].name = name->second;
  ListenFor(kTransformInterest, ChannelOf(name->second, Topic::kTransform),
            &ModuleParticipant::OnTransform, mate);
}

void ModuleParticipant::OnTransform(uint16_t mate, const uint8_t* data, size_t size) {
  const auto fits = [&] { return static_cast<uint16_t>(transform_.module_id) == mate; };
  if (!Accept(data, size, &transform_, fits)) return;
  const auto found = mailboxes_.find(mate);
  if (found == mailboxes_.end()) return;
  Mailbox& mailbox = found->second;
  trackers_[mailbox.name].Take(transform_.header.sequence, &ledger_);
  const int64_t tick = transform_.header.tick;
  // The machine may compute at once: the content must be in place before it hears of it.
  const auto slot = static_cast<size_t>(tick & 1);
  const bool useful = options_.realtime || tick == machine_.tick() || tick == machine_.tick() - 1;
  if (useful && mailbox.ticks[slot] < tick) {
    FromTransform(transform_, &mailbox.messages[slot]);
    mailbox.ticks[slot] = tick;
  }
  Tell(&ModuleLockstep::OnTransform, mate, tick);
}

void ModuleParticipant::OnAsk(const uint8_t* data, size_t size) {
  ask_t ask;
  if (!Accept(data, size, &ask)) return;
  // Whoever asks for a message still runs, so the silence that ends our waiting begins anew.
  if (ask.kind == ask_t::KIND_RESEND) {
    machine_.OnAsked(now_us());
    outbox_.Resend(ask.channel, ask.first_sequence, ask.last_sequence);
  } else if (ask.kind == ask_t::KIND_BYE) {
    machine_.OnBye(&actions_);
  }
  CarryOutActions();
}

void ModuleParticipant::CarryOut(const ModuleAction& action) {
  switch (action.kind) {
    case Kind::kHello:
      return SayHello(options_.claim, options_.build, options_.incarnation, options_.type_name,
                      options_.kinematics_hash);
    case Kind::kCompute:
      return Compute(action.tick);
    // In lockstep a TRANSFORM's number is its tick.
    case Kind::kAskMate:
      if (const auto name = directory_.find(action.mate); name != directory_.end()) {
        AskForResend(name->second, Topic::kTransform, action.tick, action.tick);
      }
      return;
    // The sim makes the run's hash of its own totals and of those that modules send here.
    case Kind::kEndAck: {
      ask_t ask = MakeAsk(ask_t::KIND_END_ACK);
      ask.acknowledged_tick = machine_.tick() - 1;
      for (const ChannelTotal& total : outbox_.totals()) ask.totals.push_back(ToWire(total));
      ask.num_totals = static_cast<int16_t>(ask.totals.size());
      return Ask(kSimProcess, std::move(ask));
    }
    case Kind::kFinish:
      return;
    // Neither of these is the run's own end, so both are errors of this process.
    case Kind::kDuplicateProcess:
      error_ = "the run '" + options_.run + "' is already at tick " + std::to_string(action.tick) +
               " and has another " + options_.module;
      return;
    case Kind::kLostSim:
      error_ = "nothing heard from the simulator of run '" + options_.run + "' any more";
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
  output_ = vm::TickOutput();
  controller_->Tick(input_, &output_);
  Publish(tick);
}

void ModuleParticipant::Publish(int64_t tick) {
  // What is published must be saved first, so it is held back meanwhile.
  if (before_publish_) outbox_.Hold();
  // A program that was replaced in this tick shows in the headers from this tick on.
  outbox_.SetProgramHash(output_.message.program_hash);
  // STATUS only when it says something new, and now and then for those who came later.
  if (output_.status.changed || tick % kStatusEveryTicks == 0) {
    for (morphbus::status_t& status : controller_->Describe(output_.status)) {
      outbox_.Send(channel_status_, tick, sim_time_us_, &status);
    }
  }
  // Neighbours need TRANSFORM for their next tick.
  ToTransform(output_.message, &transform_);
  outbox_.Send(channel_transform_, tick, sim_time_us_, &transform_);
  // Last, because the sim goes on once it has this.
  morphbus::actuator_t actuator;
  ToActuator(output_, options_.module_id, options_.num_joints, outbox_.count(channel_status_),
             &actuator);
  outbox_.Send(channel_actuator_, tick, sim_time_us_, &actuator);
  if (!before_publish_) return;
  // Saved, then sent: whoever is killed in between sends the same bytes again.
  WriteSnapshot(tick + 1);
  outbox_.Release();
}

}  // namespace morphbus::bridge
