#include "bridge/module_party.h"

#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <morphbus/actuator_t.hpp>
#include <morphbus/ask_t.hpp>
#include <morphbus/hello_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <utility>

#include "bridge/health.h"
#include "bridge/vm_codec.h"

namespace morphbus::bridge {
namespace {

using Kind = ModuleAction::Kind;
using morphbus::ask_t;

/// In real time a mate's message this many ticks old is still better than none.
constexpr int64_t kOldestUseful = 3;

/// Names of modules that are remembered, and modules that are listened to: far more than a robot
/// has, so that only messages made up in bad faith ever meet these limits.
constexpr size_t kMostNames = 4096;
constexpr size_t kMostMailboxes = 4 * vm::kMaxNeighbours;

/// First bytes of a snapshot.
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

ModuleLockstep::Config MachineConfig(const ModulePartyOptions& options) {
  return {options.realtime, options.timing};
}

}  // namespace

ModuleParty::ModuleParty(Bus* bus, ModuleBrain* brain, const TimeSource* time,
                         ModulePartyOptions options)
    : time_(time),
      brain_(brain),
      options_(std::move(options)),
      bus_(bus),
      outbox_(bus,
              Speaker{options_.run, options_.module, options_.model_hash, options_.program_hash},
              &ledger_),
      machine_(MachineConfig(options_)),
      channel_transform_(Channel(options_.run, options_.module, Topic::kTransform)),
      channel_actuator_(Channel(options_.run, options_.module, Topic::kActuator)),
      channel_status_(Channel(options_.run, options_.module, Topic::kStatus)) {}

void ModuleParty::PublishHealth() {
  morphbus::health_t health = MakeHealth(options_.module, ledger_);
  outbox_.Send(Channel(options_.run, options_.module, Topic::kHealth), machine_.tick(),
               sim_time_us_, &health);
}

void ModuleParty::OnBeforePublish(std::function<void(const std::vector<uint8_t>&)> write) {
  before_publish_ = std::move(write);
}

void ModuleParty::WriteSnapshot(int64_t next_tick) {
  if (!before_publish_) return;
  SnapshotHead head;
  head.next_tick = next_tick;
  head.claim = options_.claim;
  head.program_hash = options_.program_hash;
  head.kinematics_hash = options_.kinematics_hash;
  head.incarnation = options_.incarnation;
  head.module_id = options_.module_id;
  snapshot_.resize(sizeof head);
  brain_->Save(&snapshot_);
  head.state_size = snapshot_.size() - sizeof head;
  std::memcpy(snapshot_.data(), &head, sizeof head);
  outbox_.Save(&snapshot_);
  before_publish_(snapshot_);
}

Result<void> ModuleParty::ResumeFrom(const std::vector<uint8_t>& snapshot) {
  SnapshotHead head;
  const uint64_t magic = head.magic;
  if (snapshot.size() < sizeof head) return Fail("the snapshot is cut short");
  std::memcpy(&head, snapshot.data(), sizeof head);
  if (head.magic != magic) return Fail("the snapshot is not one of this build");
  if (head.program_hash != options_.program_hash ||
      head.kinematics_hash != options_.kinematics_hash || head.module_id != options_.module_id) {
    return Fail("the snapshot is of another module, program or build");
  }
  if (head.state_size > snapshot.size() - sizeof head) return Fail("the snapshot is cut short");
  const size_t state_end = sizeof head + head.state_size;
  const Result<size_t> used =
      outbox_.Load(snapshot.data() + state_end, snapshot.size() - state_end);
  if (!used) return tl::unexpected<Error>(used.error());
  if (!brain_->Load(snapshot.data() + sizeof head, head.state_size)) {
    return Fail("the snapshot is of another build");
  }
  options_.claim = head.claim;
  options_.incarnation = head.incarnation;
  resume_tick_ = head.next_tick;
  return {};
}

void ModuleParty::Start() {
  const auto subscribe = [this](const std::string& channel,
                                void (ModuleParty::*method)(const uint8_t*, size_t)) {
    bus_->Subscribe(channel, [this, method](std::string_view, const uint8_t* data, size_t size) {
      (this->*method)(data, size);
    });
  };
  subscribe(Channel(options_.run, kSimProcess, Topic::kClock), &ModuleParty::OnClock);
  subscribe(Channel(options_.run, kSimProcess, Topic::kSensors), &ModuleParty::OnSensors);
  subscribe(Channel(options_.run, options_.module, Topic::kAsk), &ModuleParty::OnAsk);
  if (resume_tick_ == 0) WriteSnapshot(0);
  machine_.Begin(resume_tick_, time_->NowUs(), &actions_);
  Settle();
}

void ModuleParty::OnTime() {
  ledger_.queue_overflows = bus_->queue_overflows();
  ledger_.discarded = bus_->discarded();
  machine_.OnTime(time_->NowUs(), &actions_);
  Settle();
}

int64_t ModuleParty::next_deadline_us() const { return machine_.next_deadline_us(); }
bool ModuleParty::done() const { return machine_.done(); }

void ModuleParty::OnClock(const uint8_t* data, size_t size) {
  morphbus::sim_clock_t clock;
  if (!Decode(data, size, {options_.model_hash, 0}, &clock)) {
    Bad();
    return;
  }
  ++ledger_.received;
  trackers_["CLOCK"].Take(clock.header.sequence, &ledger_);
  if (clock.phase == morphbus::sim_clock_t::PHASE_END) end_reason_ = clock.end_reason;
  machine_.OnClock(clock.header.tick, clock.phase, time_->NowUs(), &actions_);
  Settle();
}

void ModuleParty::OnSensors(const uint8_t* data, size_t size) {
  if (!Decode(data, size, {options_.model_hash, 0}, &sensors_)) {
    Bad();
    return;
  }
  ++ledger_.received;
  trackers_["SENSORS"].Take(sensors_.header.sequence, &ledger_);
  const int64_t tick = sensors_.header.tick;
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
  if (mine != nullptr && tick >= machine_.tick()) {
    vm::TickInput input;
    if (mine->name != options_.module ||
        !FromSensors(*mine, options_.num_joints, options_.num_connectors, &input)) {
      Bad();
      return;
    }
    TakeMates(input, &mates);
    if (tick == machine_.tick() || options_.realtime) {
      input_ = input;
      TakeOrders();
    }
  }
  if (options_.realtime || tick == machine_.tick()) sim_time_us_ = sensors_.header.sim_time_us;
  machine_.OnSensors(tick, sensors_.part, sensors_.num_parts, mine != nullptr, mates,
                     time_->NowUs(), &actions_);
  if (mailboxes_.size() >= kMostMailboxes) ForgetAllBut(mates);
  for (const uint16_t mate : mates) Watch(mate);
  Settle();
}

void ModuleParty::ForgetAllBut(const std::vector<uint16_t>& mates) {
  for (auto it = mailboxes_.begin(); it != mailboxes_.end();) {
    const bool mated = std::find(mates.begin(), mates.end(), it->first) != mates.end();
    if (!mated) bus_->Unsubscribe(Channel(options_.run, it->second.name, Topic::kTransform));
    it = mated ? std::next(it) : mailboxes_.erase(it);
  }
}

/// What SENSORS asks of this module besides telling it what it senses.
void ModuleParty::TakeOrders() {
  pieces_.clear();
  for (const morphbus::invoke_request_t& request : sensors_.requests) {
    if (static_cast<uint16_t>(request.module_id) != options_.module_id) continue;
    FromRequest(request, &input_.requests[input_.num_requests++]);
  }
  for (const morphbus::deploy_piece_t& piece : sensors_.pieces) {
    if (static_cast<uint16_t>(piece.module_id) == options_.module_id) pieces_.push_back(piece);
  }
}

void ModuleParty::TakeMates(const vm::TickInput& input, std::vector<uint16_t>* mates) {
  for (int c = 0; c < options_.num_connectors; ++c) {
    const vm::ConnectorReading& connector = input.connectors[c];
    if (!connector.docked || connector.mate_module == options_.module_id) continue;
    const bool known =
        std::find(mates->begin(), mates->end(), connector.mate_module) != mates->end();
    if (!known) mates->push_back(connector.mate_module);
  }
}

void ModuleParty::Watch(uint16_t mate) {
  const auto name = directory_.find(mate);
  if (name == directory_.end() || mailboxes_.contains(mate)) return;
  mailboxes_[mate].name = name->second;
  bus_->Subscribe(Channel(options_.run, name->second, Topic::kTransform),
                  [this, mate](std::string_view, const uint8_t* data, size_t size) {
                    OnTransform(mate, data, size);
                  });
}

void ModuleParty::OnTransform(uint16_t mate, const uint8_t* data, size_t size) {
  if (!Decode(data, size, {options_.model_hash, 0}, &transform_) ||
      static_cast<uint16_t>(transform_.module_id) != mate) {
    Bad();
    return;
  }
  ++ledger_.received;
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
  machine_.OnTransform(mate, tick, time_->NowUs(), &actions_);
  Settle();
}

void ModuleParty::OnAsk(const uint8_t* data, size_t size) {
  ask_t ask;
  if (!Decode(data, size, {options_.model_hash, 0}, &ask)) {
    Bad();
    return;
  }
  ++ledger_.received;
  if (ask.kind == ask_t::KIND_RESEND) {
    machine_.OnAsked(time_->NowUs());
    outbox_.Resend(ask.channel, ask.first_sequence, ask.last_sequence);
  } else if (ask.kind == ask_t::KIND_BYE) {
    machine_.OnBye(&actions_);
  }
  Settle();
}

void ModuleParty::Settle() {
  if (working_) return;  // A wish's consequence: the loop below comes to it.
  working_ = true;
  for (size_t i = 0; i < actions_.size(); ++i) {
    const ModuleAction action = actions_[i];
    Do(action);
  }
  actions_.clear();
  working_ = false;
}

void ModuleParty::Do(const ModuleAction& action) {
  switch (action.kind) {
    case Kind::kHello:
      return SayHello();
    case Kind::kCompute:
      return Compute(action.tick);
    case Kind::kAskMate:
      return AskMate(action.mate, action.tick);
    case Kind::kEndAck:
      return AcknowledgeEnd();
    case Kind::kFinish:
      return;
    case Kind::kIntruder:
      error_ = "the run '" + options_.run + "' is already at tick " + std::to_string(action.tick) +
               " and has another " + options_.module;
      return;
    case Kind::kLostSim:
      error_ = "nothing heard from the simulator of run '" + options_.run + "' any more";
      return;
  }
}

const vm::NeighbourMessage* ModuleParty::MessageOf(uint16_t mate, int64_t tick) {
  const auto found = mailboxes_.find(mate);
  if (found == mailboxes_.end()) return nullptr;
  const Mailbox& mailbox = found->second;
  const auto slot = static_cast<size_t>(tick & 1);
  if (mailbox.ticks[slot] == tick) return &mailbox.messages[slot];
  if (!options_.realtime) return nullptr;
  ++ledger_.missed_deadlines;
  const size_t newest = mailbox.ticks[0] > mailbox.ticks[1] ? 0 : 1;
  return mailbox.ticks[newest] >= tick - kOldestUseful ? &mailbox.messages[newest] : nullptr;
}

void ModuleParty::Compute(int64_t tick) {
  input_.tick = tick;
  input_.sim_time_us = sim_time_us_;
  for (int c = 0; c < options_.num_connectors; ++c) {
    const vm::ConnectorReading& connector = input_.connectors[c];
    const bool mate = connector.docked && connector.mate_module != options_.module_id && tick > 0;
    input_.messages[c] = mate ? MessageOf(connector.mate_module, tick - 1) : nullptr;
  }
  for (const morphbus::deploy_piece_t& piece : pieces_) brain_->TakePiece(piece);
  output_ = vm::TickOutput();
  brain_->Tick(input_, &output_);
  Publish(tick);
}

void ModuleParty::Publish(int64_t tick) {
  if (before_publish_) outbox_.Hold();
  outbox_.SetProgramHash(output_.message.program_hash);
  if (output_.status.changed || tick % kStatusEveryTicks == 0) {
    for (morphbus::status_t& status : brain_->Describe(output_.status)) {
      outbox_.Send(channel_status_, tick, sim_time_us_, &status);
    }
  }
  ToTransform(output_.message, &transform_);
  outbox_.Send(channel_transform_, tick, sim_time_us_, &transform_);
  // Last, because the sim goes on once it has this.
  morphbus::actuator_t actuator;
  ToActuator(output_, options_.module_id, options_.num_joints, outbox_.count(channel_status_),
             &actuator);
  outbox_.Send(channel_actuator_, tick, sim_time_us_, &actuator);
  if (!before_publish_) return;
  WriteSnapshot(tick + 1);
  outbox_.Release();
}

void ModuleParty::SayHello() {
  morphbus::hello_t hello;
  hello.process = options_.module;
  hello.pid = getpid();
  hello.claim = options_.claim;
  hello.incarnation = static_cast<int32_t>(options_.incarnation);
  hello.type_name = options_.type_name;
  hello.kinematics_hash = static_cast<int64_t>(options_.kinematics_hash);
  hello.wire_hash = static_cast<int64_t>(WireHash());
  hello.build = options_.build;
  outbox_.Send(Channel(options_.run, "", Topic::kHello), 0, 0, &hello);
}

void ModuleParty::AcknowledgeEnd() {
  ask_t ask;
  ask.from = options_.module;
  ask.kind = ask_t::KIND_END_ACK;
  ask.first_sequence = ask.last_sequence = 0;
  ask.acknowledged_tick = machine_.tick() - 1;
  for (const ChannelTotal& total : outbox_.totals()) {
    morphbus::channel_total_t wire;
    wire.channel = total.channel;
    wire.count = total.count;
    wire.hash = static_cast<int64_t>(total.hash);
    wire.hashed = 1;
    ask.totals.push_back(std::move(wire));
  }
  ask.num_totals = static_cast<int16_t>(ask.totals.size());
  outbox_.Send(Channel(options_.run, kSimProcess, Topic::kAsk), machine_.tick(), sim_time_us_,
               &ask);
}

void ModuleParty::AskMate(uint16_t mate, int64_t tick) {
  const auto name = directory_.find(mate);
  if (name == directory_.end()) return;
  ask_t ask;
  ask.from = options_.module;
  ask.kind = ask_t::KIND_RESEND;
  ask.channel = Channel(options_.run, name->second, Topic::kTransform);
  // In lockstep a TRANSFORM's number is its tick.
  ask.first_sequence = ask.last_sequence = tick;
  ask.acknowledged_tick = -1;
  ask.num_totals = 0;
  ++ledger_.asked;
  outbox_.Send(Channel(options_.run, name->second, Topic::kAsk), machine_.tick(), sim_time_us_,
               &ask);
}

}  // namespace morphbus::bridge
