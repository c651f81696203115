#include "bridge/lockstep/module/module_participant.h"

#include <algorithm>
#include <morphbus/actuator_t.hpp>
#include <morphbus/admit_t.hpp>
#include <morphbus/leave_t.hpp>
#include <morphbus/progress_t.hpp>
#include <morphbus/resend_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/transform_t.hpp>
#include <utility>

#include "bridge/wire/own_sensors.h"
#include "bridge/wire/sealed_bus.h"
#include "bridge/wire/vm_codec.h"
#include "bridge/wire/wire_size.h"

namespace morphbus::bridge {
namespace {

/// Of CLOCK a module needs the beginning and the end: in between SENSORS is its beat.
constexpr Interest kClockInterest{true, 1, OffsetOf<morphbus::sim_clock_t>("phase"),
                                  morphbus::sim_clock_t::PHASE_RUN, true};

}  // namespace

/// Nothing in it is needed any more when a handler of the bus, or OnTime, returns.
struct ModuleParticipant::Scratch {
  /// The last messages decoded or encoded, whose memory is used again and again.
  morphbus::sensors_t sensors;
  morphbus::transform_t transform;
  /// What the controller answered to the tick that is published.
  vm::TickOutput output;
  /// Whom the module is mated to, by the SENSORS that is taken and in the tick that is computed.
  std::vector<uint16_t> sensed_mates;

  /// The one of this thread, on which modules take turns. A run may go on in another thread than it
  /// began in, so nobody keeps it.
  static Scratch& OfThread() {
    static thread_local Scratch scratch;
    return scratch;
  }
};

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
      mail_(bus, options_.run, options_.model_hash, &ledger_,
            [this](uint16_t mate, const uint8_t* data, size_t size) {
              OnTransform(mate, data, size);
            }),
      inputs_({options_.module, options_.module_id, options_.num_joints, options_.num_connectors,
               options_.num_sensor_values}) {
  ledger_.restarts = options_.restarts;
  outbox_.BeginAt(options_.incarnation, options_.restarts);
}

SnapshotHead ModuleParticipant::Head() const {
  SnapshotHead head;
  head.claim = options_.claim;
  head.program_hash = options_.program_hash;
  head.kinematics_hash = options_.kinematics_hash;
  head.incarnation = options_.incarnation;
  head.module_id = options_.module_id;
  head.told = told_;
  return head;
}

void ModuleParticipant::Save(int64_t next_tick) {
  if (!before_publish_) return;
  SnapshotHead head = Head();
  head.next_tick = next_tick;
  WriteSnapshot(head, controller_, outbox_, &snapshot_);
  before_publish_(snapshot_);
}

Result<void> ModuleParticipant::ResumeFrom(const std::vector<uint8_t>& snapshot) {
  // The head of this process says which module, program and build the bytes must be of.
  const Result<SnapshotHead> head = ReadSnapshot(snapshot, Head(), controller_, &outbox_);
  if (!head) return tl::unexpected<Error>(head.error());
  // The resumed process speaks as the one that was killed, so the sim sees no second claimant.
  options_.claim = head->claim;
  options_.incarnation = std::max(options_.incarnation, head->incarnation);
  resume_tick_ = head->next_tick;
  resumed_ = true;
  told_ = head->told;
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
    Listen(ChannelOf(kSimProcess, Topic::kProgress), &ModuleParticipant::OnProgress);
    Listen(ChannelOf(options_.module, Topic::kResend), &ModuleParticipant::OnResend);
    if (takes_place) Listen(ChannelOf(kSimProcess, Topic::kAdmit), &ModuleParticipant::OnAdmit);
    // Which modules are our neighbours SENSORS will tell.
    if (!takes_place && resume_tick_ == 0) mail_.ListenToAll();
  }
  if (takes_place) return Tell(&ModuleLockstep::Begin, ModuleLockstep::kUnknownTick);
  // A process that is killed before its next answer resumes from here, in the same incarnation.
  Save(resume_tick_);
  Tell(&ModuleLockstep::Begin, resume_tick_);
  // What its predecessor was told of the end, and may not have acknowledged, is not said again.
  if (told_ == Farewell::kLeave) machine_.OnLeave(now_us(), &actions_);
  if (told_ == Farewell::kEnd) {
    machine_.OnClock(resume_tick_, morphbus::sim_clock_t::PHASE_END, now_us(), &actions_);
  }
  CarryOutActions();
}

void ModuleParticipant::OnTime() {
  LockstepParticipant::OnTime();
  // A neighbour's TRANSFORM mostly comes before SENSORS and need not wake the process; it must
  // where the tick only waits for that.
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

void ModuleParticipant::OnSensors(const uint8_t* data, size_t size) {
  // Once the names of all are known nothing more is looked for in the others' readings.
  const NameDirectory::Part* known =
      narrowed_ ? nullptr : directory_->PartOf(MessageDigest(data, size));
  if (known != nullptr && !known->Holds(options_.module_id)) return TakeKnownPart(*known);
  // SENSORS holds many modules' readings: we take our own.
  morphbus::sensors_t& sensors = Scratch::OfThread().sensors;
  const Expectation expect{options_.model_hash, 0};
  const bool sound = DecodeOwnSensors(data, size, expect, options_.module_id, &sensors).has_value();
  ++(sound ? ledger_.received : ledger_.bad);
  if (!sound) return;
  const bool mine = !sensors.modules.empty();
  vm::TickInput input;
  // A reading that cannot be ours takes the place of none.
  if (mine && !inputs_.Read(sensors.modules.front(), &input)) {
    ++ledger_.bad;
    return;
  }
  if (!narrowed_) directory_->Learn(sensors, data, size);
  // What the machine is told must be of the tick to come: then it waits for these neighbours.
  const int64_t tick = sensors.header.tick;
  std::vector<uint16_t>& mates = Scratch::OfThread().sensed_mates;
  mates.clear();
  if (mine && tick >= machine_.tick()) inputs_.AddMates(input, &mates);
  const Taken taken =
      machine_.OnSensors(tick, sensors.part, sensors.num_parts, mine, mates, now_us(), &actions_);
  if (taken == Taken::kImpossible) CountOutside("SIM/SENSORS", tick);
  if (taken == Taken::kFresh || taken == Taken::kKnown) {
    // Of the parts only ours is needed for good, so its ticks are counted.
    if (mine) Track(&sensors_tracker_, "SIM/SENSORS", tick, MessageDigest(data, size));
    if (taken == Taken::kFresh) sim_time_us_ = sensors.header.sim_time_us;
    if (taken == Taken::kFresh && mine) inputs_.Take(input, sensors);
    // Another part than ours may be the one that names a neighbour.
    if (!narrowed_ && !mine) inputs_.AddMates(&mates);
    UpdateSubscriptions(mates, mine ? sensors.part : -1);
  }
  CarryOutActions();
}

void ModuleParticipant::TakeKnownPart(const NameDirectory::Part& part) {
  ++ledger_.received;
  std::vector<uint16_t>& mates = Scratch::OfThread().sensed_mates;
  mates.clear();
  const Taken taken =
      machine_.OnSensors(part.tick, part.part, part.num_parts, false, mates, now_us(), &actions_);
  if (taken == Taken::kImpossible) CountOutside("SIM/SENSORS", part.tick);
  if (taken == Taken::kFresh || taken == Taken::kKnown) {
    // It may be the one that names a neighbour.
    inputs_.AddMates(&mates);
    UpdateSubscriptions(mates, -1);
  }
  CarryOutActions();
}

void ModuleParticipant::UpdateSubscriptions(const std::vector<uint16_t>& mates, int own_part) {
  const SubscriptionBatch together(bus_);
  // Neighbours come and go; a module that is not mated any more makes room.
  if (mail_.full()) {
    for (const uint16_t forgotten : mail_.ForgetAllBut(mates)) machine_.Forget(forgotten);
  }
  for (const uint16_t mate : mates) {
    if (const std::string* name = directory_->NameOf(mate)) mail_.Listen(mate, *name);
  }
  // Every module's name is known once all parts have come; then our own part is enough.
  if (own_part >= 0 && !narrowed_ && machine_.knows_all()) {
    narrowed_ = true;
    const Interest own{true, 2, OffsetOf<morphbus::sensors_t>("part"),
                       static_cast<uint16_t>(own_part), false};
    ListenFor(own, ChannelOf(kSimProcess, Topic::kSensors), &ModuleParticipant::OnSensors);
  }
  // With tick 0 answered the module knows its neighbours, and the others' messages are of no use.
  if (machine_.tick() > 0) mail_.ListenToKnown();
}

void ModuleParticipant::OnTransform(uint16_t mate, const uint8_t* data, size_t size) {
  morphbus::transform_t& transform = Scratch::OfThread().transform;
  NeighbourMail::Box* box = mail_.BoxOf(mate);
  // Where a thousand modules share a process, the box is mostly not in the processor's cache: it is
  // fetched while the message is decoded.
  if (box != nullptr) box->tracker.FetchNext();
  const auto fits = [&] { return static_cast<uint16_t>(transform.module_id) == mate; };
  if (!Accept(data, size, &transform, fits) || box == nullptr) return;
  const int64_t tick = transform.header.tick;
  const int64_t number = transform.header.sequence;
  const std::string channel = box->name + "/TRANSFORM";
  const Taken taken = machine_.OnTransform(mate, number, tick, now_us(), &actions_);
  if (taken == Taken::kImpossible) CountOutside(channel, tick);
  if (taken == Taken::kFresh || taken == Taken::kKnown) {
    Track(&box->tracker, channel, number, MessageDigest(data, size));
    if (taken == Taken::kFresh) FromTransform(transform, &box->MessageOf(tick));
  }
  CarryOutActions();
}

void ModuleParticipant::OnResend(const uint8_t* data, size_t size) {
  morphbus::resend_t ask;
  if (!Accept(data, size, &ask)) return;
  // A process that asks for a message still runs, so the silence that ends our waiting begins anew.
  machine_.OnAsked(ask.header.tick, now_us());
  outbox_.Resend(ask.channel, ask.first_sequence, ask.last_sequence, now_us());
}

void ModuleParticipant::OnLeave(const uint8_t* data, size_t size) {
  morphbus::leave_t leave;
  if (!Accept(data, size, &leave)) return;
  // A LEAVE that names no process is for all: the run is over.
  if (leave.process.empty()) {
    machine_.OnLeaveAll(&actions_);
  } else if (leave.process == options_.module && !machine_.joining()) {
    machine_.OnLeave(now_us(), &actions_);
  }
  CarryOutActions();
}

void ModuleParticipant::OnProgress(const uint8_t* data, size_t size) {
  morphbus::progress_t progress;
  if (Accept(data, size, &progress)) Tell(&ModuleLockstep::OnProgress, progress.header.tick);
}

void ModuleParticipant::OnAdmit(const uint8_t* data, size_t size) {
  morphbus::admit_t admit;
  if (!Accept(data, size, &admit)) return;
  // The sim answers every HELLO, and one that was said by a process before this one.
  if (!machine_.joining() || admit.module_name != options_.module ||
      admit.claim != options_.claim) {
    return;
  }
  // Numbers on our channels go on where the predecessor's ended.
  outbox_.ContinueAfter(channel_transform_, admit.actuator_count);
  outbox_.ContinueAfter(channel_actuator_, admit.actuator_count);
  outbox_.ContinueAfter(channel_status_, admit.status_count);
  machine_.OnAdmit(admit.last_tick + 1, now_us());
  Save(machine_.tick());
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
      // Saved before it is acknowledged: started again, the process must neither take part once
      // more nor wait for a run that is over.
      if (told_ == Farewell::kNone) {
        told_ = machine_.left() ? Farewell::kLeave : Farewell::kEnd;
        Save(machine_.tick());
      }
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
  NeighbourMail::Box* box = mail_.BoxOf(mate);
  if (box == nullptr) return nullptr;
  if (machine_.Has(mate, tick)) return &box->MessageOf(tick);
  // In real time an older message is better than none, for a while.
  if (!options_.realtime) return nullptr;
  ++ledger_.missed_deadlines;
  const int64_t newest = machine_.NewestOf(mate);
  const bool useful = newest >= 0 && newest >= tick - kOldestUsefulTicks;
  return useful ? &box->MessageOf(newest) : nullptr;
}

void ModuleParticipant::Compute(int64_t tick) {
  // The tick's input: sensors, and what each neighbour said a tick ago.
  inputs_.Compute(
      tick, sim_time_us_, [&](uint16_t mate) { return MessageOf(mate, tick - 1); }, controller_,
      &Scratch::OfThread().output);
  Publish(tick);
}

void ModuleParticipant::Publish(int64_t tick) {
  const vm::TickOutput& output = Scratch::OfThread().output;
  // What is published must be saved first, so it is held back meanwhile.
  if (before_publish_) outbox_.Hold();
  // A program that was replaced in this tick shows in the headers from this tick on.
  outbox_.SetProgramHash(output.message.program_hash);
  // STATUS only when it says something new or is asked for, and now and then for those who came
  // later.
  const bool inspected = inputs_.TakeInspection();
  if (output.status.changed || inspected || tick % kStatusEveryTicks == 0) {
    for (morphbus::status_t& status : controller_->Describe(output.status, inspected)) {
      outbox_.Send(channel_status_, tick, sim_time_us_, &status);
    }
  }
  // Neighbours need TRANSFORM for their next tick.
  morphbus::transform_t& transform = Scratch::OfThread().transform;
  ToTransform(output.message, &transform);
  outbox_.Send(channel_transform_, tick, sim_time_us_, &transform);
  // Last, because the sim goes on once it has this.
  morphbus::actuator_t actuator;
  ToActuator(output, options_.module_id, options_.num_joints, outbox_.count(channel_status_),
             &actuator);
  outbox_.Send(channel_actuator_, tick, sim_time_us_, &actuator);
  if (!before_publish_) return;
  // Saved, then sent: a process that is killed in between sends the same bytes again.
  Save(tick + 1);
  outbox_.Release();
}

}  // namespace morphbus::bridge
