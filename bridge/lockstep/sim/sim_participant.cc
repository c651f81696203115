#include "bridge/lockstep/sim/sim_participant.h"

#include <algorithm>
#include <morphbus/actuator_t.hpp>
#include <morphbus/hello_t.hpp>
#include <morphbus/leave_t.hpp>
#include <morphbus/progress_t.hpp>
#include <morphbus/resend_t.hpp>
#include <morphbus/totals_t.hpp>
#include <morphbus/transform_t.hpp>
#include <morphbus/verdict_t.hpp>
#include <utility>

namespace morphbus::bridge {
namespace {

/// What the state machine needs to know of the options.
SimLockstep::Config MachineConfig(const SimParticipantOptions& options) {
  SimLockstep::Config config = options;
  config.num_modules = static_cast<int>(options.modules.size());
  return config;
}

}  // namespace

SimParticipant::SimParticipant(Bus* bus, SimulatedRobot* robot, const TimeSource* time,
                               SimParticipantOptions options)
    : LockstepParticipant(bus, time, {options.run, std::string(kSimProcess), options.model_hash, 0},
                          MachineConfig(options)),
      robot_(robot),
      options_(std::move(options)),
      members_(options_, options_.logger, options_.realtime),
      publisher_(&outbox_, options_.modules, options_.tick_us),
      commands_(options_.modules.size()),
      orders_(options_.modules),
      delivery_(options_.modules, options_.realtime),
      ending_(members_.num_modules(), options_.logger, options_.realtime, options_.end_reason),
      punctuality_(members_.num_modules()),
      received_(options_.modules.size()) {}

void SimParticipant::Start() {
  // HELLO, RESEND and TOTALS have one channel for all senders, ACTUATOR one for each module.
  {
    const SubscriptionBatch together(bus_);
    Listen(ChannelOf("", Topic::kHello), &SimParticipant::OnHello);
    Listen(ChannelOf(kSimProcess, Topic::kResend), &SimParticipant::OnResend);
    Listen(ChannelOf("", Topic::kTotals), &SimParticipant::OnTotals);
    if (options_.logger) {
      Listen(ChannelOf(kLogProcess, Topic::kProgress), &SimParticipant::OnProgress);
    }
    for (int i = 0; i < members_.num_modules(); ++i) {
      Listen(ChannelOf(members_.name(i), Topic::kActuator), &SimParticipant::OnActuator, i);
    }
  }
  // From here on HELLOs are awaited; tick 0 goes out when all have said theirs.
  report_missing_due_us_ = now_us() + options_.timing.report_missing_us;
  Tell(&SimLockstep::Begin);
}

void SimParticipant::OnTime() {
  // The machine counts deadlines; the ledger passes them on with HEALTH.
  ledger_.missed_deadlines = machine_.missed_deadlines();
  LockstepParticipant::OnTime();
  ReportMissing();
}

void SimParticipant::ReportMissing() {
  // Once the run has begun, everybody has joined.
  if (machine_.started() || now_us() < report_missing_due_us_ || !report_missing_) return;
  report_missing_due_us_ = now_us() + options_.timing.report_missing_us;
  const std::vector<std::string> missing = missing_processes();
  if (!missing.empty()) report_missing_(missing);
}

void SimParticipant::RequestStop(const std::string& reason) {
  // The tick that is out is still answered, so that the log ends with a whole one.
  ending_.AskFor(reason);
  Tell(&SimLockstep::Stop, false);
}

void SimParticipant::Refuse(const std::string& why) {
  ending_.Refuse(why);
  // A run that cannot go on ends at once: the present tick's answers are not asked for.
  Tell(&SimLockstep::Stop, true);
}

std::vector<std::string> SimParticipant::missing_processes() const {
  std::vector<std::string> missing;
  for (int i = 0; i < members_.size(); ++i) {
    if (!machine_.attendance().greeted(i)) missing.push_back(members_.name(i));
  }
  return missing;
}

std::vector<std::string> SimParticipant::GoneModules() const {
  std::vector<std::string> gone;
  for (int i = 0; i < members_.num_modules(); ++i) {
    if (machine_.attendance().gone(i)) gone.push_back(members_.name(i));
  }
  return gone;
}

void SimParticipant::OnHello(const uint8_t* data, size_t size) {
  morphbus::hello_t hello;
  // Of another model it is refused by name, and not dropped silently.
  if (!Decode(data, size, {}, &hello)) {
    ++ledger_.bad;
    return;
  }
  ++ledger_.received;
  const int process = members_.NumberOf(hello.process);
  const bool module = IsModule(process);
  const RunMembers::Standing standing = {machine_.started(), machine_.ending(),
                                         module && machine_.attendance().lost(process),
                                         module && machine_.attendance().answered(process)};
  std::string why;
  const RunMembers::Welcome welcome = members_.OnHello(hello, standing, now_us(), &why);
  if (welcome == RunMembers::Welcome::kUnfit) return Refuse(why);
  // A process that is turned away changes nothing: the run goes on with its members.
  if (welcome == RunMembers::Welcome::kTurnedAway) return;
  // Of a later incarnation than the first, a module does not know where the run is.
  if (module && hello.incarnation > 1) Admit(process);
  if (welcome == RunMembers::Welcome::kJoins) return Tell(&SimLockstep::OnHello, process);
  if (welcome == RunMembers::Welcome::kReplaces && replaced_) {
    replaced_(static_cast<size_t>(process), machine_.tick());
  }
}

void SimParticipant::Admit(int module) {
  // The present tick is the first that the predecessor has not answered, or else the next one is.
  // In real time the newest sensors decide.
  const int64_t last =
      machine_.attendance().answered(module) ? machine_.tick() : machine_.tick() - 1;
  Say(kSimProcess, Topic::kAdmit, members_.AdmissionOf(module, last));
}

void SimParticipant::OnActuator(int module, const uint8_t* data, size_t size) {
  // A command must be of the module whose channel it came on, and for all of its joints.
  const auto place = static_cast<size_t>(module);
  const ExpectedModule& expected = options_.modules[place];
  const auto fits = [&] {
    const auto& readings = readings_.modules();
    return command_.module_id == static_cast<int16_t>(expected.id) &&
           (place >= readings.size() || command_.num_joints == readings[place].num_joints);
  };
  if (!Accept(data, size, &command_, fits)) return;
  const int64_t tick = command_.header.tick;
  const int64_t number = command_.header.sequence;
  const std::string channel = expected.name + "/ACTUATOR";
  // In lockstep no module answers a tick that is not out, or long over, and a command's number is
  // its tick. In real time an answer may come any time late.
  const bool can_be = options_.realtime || (tick <= machine_.tick() &&
                                            tick >= machine_.tick() - kKeptTicks && number == tick);
  if (!can_be) return CountOutside(channel, tick);
  // Old and repeated commands count in the ledger.
  const SequenceTracker::Kind kind =
      Track(&received_[place], channel, number, MessageDigest(data, size));
  if (kind == SequenceTracker::Kind::kConflict) return;
  if (machine_.attendance().gone(module)) return;
  const bool fresh = kind != SequenceTracker::Kind::kDuplicate;
  if (options_.realtime && tick < machine_.tick() && fresh) {
    punctuality_.CameLate(module, tick, now_us());
  }
  // What anybody can say again shows no module alive.
  if (fresh) members_.Heard(module, now_us());
  // In lockstep a module can have answered no tick but this one and those before.
  if (options_.realtime || tick == machine_.tick()) {
    members_.Published(module, number + 1, command_.status_count);
  }
  // The machine learns of repetitions, too, whether it had asked for them.
  if (tick == machine_.tick()) commands_.Keep(place, &command_);
  Tell(&SimLockstep::OnActuator, module, tick);
}

void SimParticipant::OnResend(const uint8_t* data, size_t size) {
  morphbus::resend_t ask;
  if (!Accept(data, size, &ask)) return;
  outbox_.Resend(ask.channel, ask.first_sequence, ask.last_sequence, now_us());
}

void SimParticipant::OnProgress(const uint8_t* data, size_t size) {
  morphbus::progress_t progress;
  if (!Accept(data, size, &progress)) return;
  Tell(&SimLockstep::OnLogAck, progress.complete_tick);
  if (progress.verdict_heard) Tell(&SimLockstep::OnVerdictAck);
}

void SimParticipant::OnTotals(const uint8_t* data, size_t size) {
  morphbus::totals_t totals;
  int process = -1;
  const auto fits = [&] { return (process = members_.NumberOf(totals.process)) >= 0; };
  if (!Accept(data, size, &totals, fits)) return;
  const bool leaves = IsModule(process) && machine_.attendance().lost(process);
  // Totals are final only when the run ends, or of a module that leaves it.
  if (!machine_.ending() && !leaves) return;
  // The logger has been told how the run ended, by what was known then: that must not change.
  if (verdict_told_) return;
  // Every process says it again until all have said it.
  if (ending_.Take(process, totals)) Tell(&SimLockstep::OnEndAck, process);
}

void SimParticipant::OnTransform(size_t module, const uint8_t* data, size_t size) {
  morphbus::transform_t transform;
  if (!Accept(data, size, &transform)) return;
  delivery_.OnNews(module, static_cast<uint64_t>(transform.news.hash));
}

void SimParticipant::ListenForNews() {
  // In real time a piece that was lost is not asked for: the module is listened to instead.
  const std::optional<size_t> awaited = delivery_.awaited();
  if (awaited == listened_to_) return;
  const auto channel = [this](size_t module) {
    return ChannelOf(options_.modules[module].name, Topic::kTransform);
  };
  if (listened_to_) bus_->Unsubscribe(channel(*listened_to_));
  if (awaited) Listen(channel(*awaited), &SimParticipant::OnTransform, *awaited);
  listened_to_ = awaited;
}

void SimParticipant::CarryOut(const SimAction& action) {
  switch (action.kind) {
    case SimAction::Kind::kPublishClock:
      return BeginTick(action.tick);
    case SimAction::Kind::kPublishReadings:
      return PublishReadings(action.tick);
    case SimAction::Kind::kRepeatClock:
      return publisher_.RepeatClock(action.tick);
    // A tick that all have answered is repeated to show that we are still there.
    case SimAction::Kind::kRepeatReadings:
      return publisher_.RepeatSensors(action.tick, [this](size_t module) {
        return machine_.attendance().AllAnswered() ||
               !machine_.attendance().answered(static_cast<int>(module));
      });
    case SimAction::Kind::kAdvance:
      return Advance(action.tick);
    case SimAction::Kind::kAskModule:
      // In lockstep the number is the tick; in real time no answer is asked for.
      return AskForResend(members_.name(action.process), Topic::kActuator, action.tick,
                          action.tick);
    // The header of the request says at which tick the sim is.
    case SimAction::Kind::kPollLogger:
      return AskForResend(kLogProcess, Topic::kProgress, 0, 0);
    case SimAction::Kind::kPublishEnd:
      return publisher_.PublishEnd(action.tick, ending_.ChooseReason(EndFacts()));
    case SimAction::Kind::kAskToLeave:
      return Say(kSimProcess, Topic::kLeave, morphbus::leave_t{{}, members_.name(action.process)});
    // Where something must be done between two ticks, the next one waits for PassBarrier.
    case SimAction::Kind::kAtBarrier:
      return at_barrier_ ? at_barrier_() : PassBarrier();
    case SimAction::Kind::kRepeatEnd:
      return publisher_.RepeatEnd();
    case SimAction::Kind::kTellVerdict:
      return TellVerdict();
    case SimAction::Kind::kSayProgress:
      return Say(
          kSimProcess, Topic::kProgress,
          morphbus::progress_t{
              {}, machine_.attendance().AllAnswered() ? action.tick : action.tick - 1, false});
    case SimAction::Kind::kLeaveAll:
      // Not acknowledged, hence several: who misses all of them leaves after a second of silence.
      for (int i = 0; i < 4; ++i) Say(kSimProcess, Topic::kLeave, morphbus::leave_t());
      return;
    case SimAction::Kind::kFinish:
      return ending_.Conclude(EndFacts(), outbox_.totals());
  }
}

void SimParticipant::BeginTick(int64_t tick) {
  // A robot that broke down in the tick before has nothing to tell of this one.
  if (const std::string why = robot_->Breakdown(); !why.empty()) return Refuse(why);
  // Controls take effect before the sensors of the tick are read.
  if (before_tick_) before_tick_(tick);
  // Everybody's readings are of the same moment.
  readings_.Sense(robot_, sense_root_);
  readings_.HideLost([this](int id) { return IsModule(id) && machine_.attendance().lost(id); });
  if (const std::string why = readings_.WhyUnusable(options_.modules.size()); !why.empty()) {
    return Refuse(why + " (tick " + std::to_string(tick) + ")");
  }
  publisher_.PublishClock(tick, machine_.started(), readings_);
}

void SimParticipant::PublishReadings(int64_t tick) {
  // The robot cannot be sensed: the run ends.
  if (!ending_.refusal().empty()) return;
  publisher_.PublishReadings(tick, readings_,
                             [&](const std::vector<size_t>& members, morphbus::sensors_t* part) {
                               orders_.AddTo(members, part);
                               delivery_.AddTo(members, tick, part);
                               ListenForNews();
                             });
  // Sensing takes a while, during which no module is late.
  machine_.OnPublished(now_us());
  if (after_tick_) after_tick_(tick);
}

void SimParticipant::Advance(int64_t tick) {
  if (options_.realtime) punctuality_.TickOver(tick, now_us());
  commands_.Actuate(robot_, [this](size_t module) {
    // Real time: this one came too late. Of a module that is lost nothing is awaited.
    const int place = static_cast<int>(module);
    if (!machine_.attendance().gone(place)) punctuality_.Missed(place);
  });
  robot_->Advance();
  // Found out here and not by the next tick's sensors, which the last tick does not have.
  const std::string why = robot_->Breakdown();
  if (!why.empty()) ending_.Refuse(why + " (tick " + std::to_string(tick) + ")");
}

std::vector<morphbus::lateness_t> SimParticipant::Lateness() const {
  std::vector<morphbus::lateness_t> lateness;
  for (int i = 0; i < members_.num_modules(); ++i) {
    const Punctuality::Record& record = punctuality_.records()[i];
    if (record.missed == 0) continue;
    morphbus::lateness_t& entry = lateness.emplace_back();
    entry.module_name = members_.name(i);
    entry.missed = record.missed;
    entry.late = record.late;
    entry.worst_us = record.worst_us;
  }
  return lateness;
}

RunEnding::Facts SimParticipant::EndFacts() const {
  RunEnding::Facts facts;
  facts.ticks = machine_.tick();
  facts.missed_deadlines = machine_.missed_deadlines();
  for (const int process : machine_.silent()) facts.silent.push_back(members_.name(process));
  facts.gone = GoneModules();
  facts.all_acknowledged = machine_.attendance().AllModulesAcknowledged();
  facts.unvouched = members_.unvouched();
  return facts;
}

void SimParticipant::TellVerdict() {
  // The machine may still find that the logger keeps silent, so the outcome is worked out once more
  // at the end.
  ending_.Conclude(EndFacts(), outbox_.totals());
  verdict_told_ = true;
  Say(kSimProcess, Topic::kVerdict,
      morphbus::verdict_t{{}, CutText(ending_.outcome().error, kLongestText)});
}

}  // namespace morphbus::bridge
