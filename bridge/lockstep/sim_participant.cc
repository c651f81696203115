#include "bridge/lockstep/sim_participant.h"

#include <algorithm>
#include <morphbus/actuator_t.hpp>
#include <morphbus/leave_t.hpp>
#include <morphbus/progress_t.hpp>
#include <morphbus/resend_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/totals_t.hpp>
#include <morphbus/verdict_t.hpp>
#include <utility>

#include "bridge/wire/vm_codec.h"
#include "compiler/base/text.h"
#include "vm/limits.h"

namespace morphbus::bridge {
namespace {

using morphbus::sim_clock_t;

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
      channel_clock_(Channel(options_.run, kSimProcess, Topic::kClock)),
      channel_sensors_(Channel(options_.run, kSimProcess, Topic::kSensors)),
      channel_world_(Channel(options_.run, kSimProcess, Topic::kWorld)),
      punctuality_(static_cast<int>(options_.modules.size())) {
  // The machine calls processes by number: the modules in order of id, then the logger.
  for (const ExpectedModule& module : options_.modules) names_.push_back(module.name);
  if (options_.logger) names_.emplace_back(kLogProcess);
  for (size_t i = 0; i < names_.size(); ++i) numbers_.emplace(names_[i], static_cast<int>(i));
  claims_.assign(names_.size(), 0);
  incarnations_.assign(names_.size(), 1);
  heard_us_.assign(names_.size(), 0);
  num_actuators_.assign(options_.modules.size(), 0);
  num_status_ = num_actuators_;
  commands_.resize(options_.modules.size());
  received_.resize(options_.modules.size());
  reports_.resize(names_.size());
  // No command has come for any tick yet.
  for (morphbus::actuator_t& command : commands_) {
    command.header.tick = -1;
    command.header.program_hash = 0;
  }
}

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
    for (size_t i = 0; i < options_.modules.size(); ++i) {
      Listen(ChannelOf(options_.modules[i].name, Topic::kActuator), &SimParticipant::OnActuator, i);
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
  // The first reason is the one that the run ended for.
  if (outcome_.reason.empty()) outcome_.reason = CutText(reason, kLongestText);
  Tell(&SimLockstep::Stop, false);
}

void SimParticipant::AnnounceControl(const std::string& text) {
  controls_.push_back(CutText(text, kLongestText));
}

std::vector<std::string> SimParticipant::missing_processes() const {
  std::vector<std::string> missing;
  for (size_t i = 0; i < names_.size(); ++i) {
    if (!machine_.greeted(static_cast<int>(i))) missing.push_back(names_[i]);
  }
  return missing;
}

int SimParticipant::ProcessNumber(const std::string& name) const {
  const auto found = numbers_.find(name);
  return found == numbers_.end() ? -1 : found->second;
}

void SimParticipant::OnHello(const uint8_t* data, size_t size) {
  constexpr size_t kMostTurnedAway = 16;
  morphbus::hello_t hello;
  // The model's hash is checked below, to refuse by name instead of dropping silently.
  if (!Decode(data, size, {}, &hello)) {
    ++ledger_.bad;
    return;
  }
  ++ledger_.received;
  // Whoever is turned away below did not harm the run; a misfit before tick 0 is over ends it.
  const int process = ProcessNumber(hello.process);
  std::string why;
  if (process < 0) {
    why = "'" + hello.process + "' is not part of this run";
  } else {
    // The first claimant of a name whose images fit is believed, until the run has begun.
    int64_t& claim = claims_[process];
    if (claim == 0 && !machine_.started()) {
      if (const std::string unfit = HelloError(process, hello); !unfit.empty())
        return Refuse(unfit);
      claim = hello.claim;
      incarnations_[process] = static_cast<uint32_t>(hello.incarnation);
      heard_us_[process] = now_us();
      if (hello.incarnation > 1) Admit(process);
      return Tell(&SimLockstep::OnHello, process);
    }
    // The same process says HELLO again until it hears CLOCK, or is told where the run is.
    if (claim == hello.claim) return hello.incarnation > 1 ? Admit(process) : void();
    if (static_cast<uint32_t>(hello.incarnation) > incarnations_[process]) {
      why = TakePlace(process, hello);
      if (why.empty()) return;
    }
    if (why.empty())
      why =
          "a second process (pid " + std::to_string(hello.pid) + ") claims to be " + hello.process;
    if (!machine_.started() && hello.incarnation <= 1) return Refuse(why);
  }
  // A process that tries again and again is listed once.
  if (std::find(turned_away_.begin(), turned_away_.end(), why) != turned_away_.end()) return;
  if (turned_away_.size() < kMostTurnedAway) turned_away_.push_back(why);
}

void SimParticipant::OnActuator(size_t module, const uint8_t* data, size_t size) {
  morphbus::actuator_t& command = command_;
  // A command must be of the module whose channel it came on, and for all of its joints.
  const ExpectedModule& expected = options_.modules[module];
  const auto fits = [&] {
    return command.module_id == static_cast<int16_t>(expected.id) &&
           (module >= sensed_.size() || command.num_joints == sensed_[module].num_joints);
  };
  if (!Accept(data, size, &command, fits)) return;
  const int64_t tick = command.header.tick;
  const std::string channel = expected.name + "/ACTUATOR";
  // In lockstep nobody answers a tick that is not out, or long over, and a command's number is its
  // tick. In real time an answer may come any time late.
  const bool can_be =
      options_.realtime || (tick <= machine_.tick() && tick >= machine_.tick() - kKeptTicks &&
                            command.header.sequence == tick);
  if (!can_be) {
    return CountRefused(
        &Ledger::outside_window, channel,
        "tick " + std::to_string(tick) + " in tick " + std::to_string(machine_.tick()));
  }
  // Old and repeated commands count in the ledger; only the first one of this tick is used.
  const uint64_t digest = MessageDigest(data, size);
  SequenceTracker::Kind kind = SequenceTracker::Kind::kNext;
  if (!Track(&received_[module], channel, command.header.sequence, digest, &kind)) return;
  const bool fresh = kind != SequenceTracker::Kind::kDuplicate;
  if (machine_.gone(static_cast<int>(module))) return;
  const bool late = options_.realtime && tick < machine_.tick();
  if (late && fresh) {
    punctuality_.CameLate(static_cast<int>(module), tick, now_us());
  }
  heard_us_[module] = now_us();
  // In lockstep a module can have answered no tick but this one and those before.
  if (options_.realtime || tick == machine_.tick()) {
    num_actuators_[module] = std::max(num_actuators_[module], command.header.sequence + 1);
    num_status_[module] = std::max(num_status_[module], command.status_count);
  }
  // The machine learns of those, too, whether it had asked for them.
  const bool had = tick != machine_.tick() || commands_[module].header.tick == tick;
  if (had) return Tell(&SimLockstep::OnActuator, static_cast<int>(module), tick);
  // The command is kept until everybody has answered; only then does the robot move.
  std::swap(commands_[module], command);
  Tell(&SimLockstep::OnActuator, static_cast<int>(module), tick);
}

void SimParticipant::OnResend(const uint8_t* data, size_t size) {
  morphbus::resend_t ask;
  if (!Accept(data, size, &ask)) return;
  outbox_.Answer(ask.channel, ask.first_sequence, ask.last_sequence, now_us());
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
  const auto fits = [&] { return (process = ProcessNumber(totals.process)) >= 0; };
  if (!Accept(data, size, &totals, fits)) return;
  // What the logger was told of the run's end holds.
  const bool leaves = process != machine_.logger_number() && machine_.lost(process);
  if (verdict_told_ || (!machine_.ending() && !leaves)) return;
  // Every process says it again until all have said it. In real time the logger goes on recording
  // what comes late: its first whole report counts.
  if (reports_[process].Take(totals)) Tell(&SimLockstep::OnEndAck, process);
}

void SimParticipant::CarryOut(const SimAction& action) {
  switch (action.kind) {
    case SimAction::Kind::kPublishClock:
      return BeginTick(action.tick);
    // Sensing takes a while, during which nobody else is late.
    case SimAction::Kind::kPublishReadings:
      // The robot cannot be sensed: the run ends.
      if (!refusal_.empty()) return;
      PublishSensors(action.tick);
      PublishWorld(action.tick);
      machine_.OnPublished(now_us());
      if (after_tick_) after_tick_(action.tick);
      return;
    case SimAction::Kind::kRepeatClock:
      outbox_.Resend(channel_clock_, action.tick, action.tick);
      return;
    // WORLD is not repeated: only the logger needs it, and asks for what it lacks.
    case SimAction::Kind::kRepeatReadings:
      return RepeatSensors(action.tick);
    case SimAction::Kind::kAdvance:
      return Advance(action.tick);
    case SimAction::Kind::kAskModule:
      // In lockstep the number is the tick; in real time nobody asks.
      return AskForResend(names_[action.process], Topic::kActuator, action.tick, action.tick);
    // The header of the request says at which tick the sim is.
    case SimAction::Kind::kPollLogger:
      return AskForResend(kLogProcess, Topic::kProgress, 0, 0);
    case SimAction::Kind::kPublishEnd:
      return PublishClock(action.tick, sim_clock_t::PHASE_END);
    case SimAction::Kind::kAskToLeave:
      return Say(kSimProcess, Topic::kLeave, morphbus::leave_t{{}, names_[action.process]});
    case SimAction::Kind::kAtBarrier:
      return at_barrier_ ? at_barrier_() : PassBarrier();
    // END is the last message on CLOCK.
    case SimAction::Kind::kRepeatEnd: {
      const int64_t last = outbox_.count(channel_clock_) - 1;
      outbox_.Resend(channel_clock_, last, last);
      return;
    }
    case SimAction::Kind::kTellVerdict:
      return TellVerdict();
    case SimAction::Kind::kBye:
      // Not acknowledged, hence several: who misses all of them leaves after a second of silence.
      for (int i = 0; i < 4; ++i) Say(kSimProcess, Topic::kLeave, morphbus::leave_t());
      return;
    case SimAction::Kind::kFinish:
      return Conclude();
  }
}

std::vector<morphbus::lateness_t> SimParticipant::Lateness() const {
  std::vector<morphbus::lateness_t> lateness;
  for (size_t i = 0; i < options_.modules.size(); ++i) {
    const Punctuality::Record& record = punctuality_.records()[i];
    if (record.missed == 0) continue;
    morphbus::lateness_t& entry = lateness.emplace_back();
    entry.module_name = options_.modules[i].name;
    entry.missed = record.missed;
    entry.late = record.late;
    entry.worst_us = record.worst_us;
  }
  return lateness;
}

void SimParticipant::Advance(int64_t tick) {
  if (options_.realtime) punctuality_.TickOver(tick, now_us());
  for (size_t i = 0; i < commands_.size(); ++i) {
    morphbus::actuator_t& command = commands_[i];
    if (command.header.tick < 0) {
      // Real time: this one came too late. Of a module that is lost nothing is awaited.
      if (!machine_.gone(static_cast<int>(i))) punctuality_.Missed(static_cast<int>(i));
      continue;
    }
    // In order of modules, whatever the order of arrival, so that the robot moves the same every
    // time.
    robot_->Actuate(command);
    command.header.tick = -1;
  }
  robot_->Advance();
  // Found out here and not by the next tick's sensors, which the last tick does not have.
  if (const std::string why = robot_->Breakdown(); !why.empty() && refusal_.empty()) {
    refusal_ = why + " (tick " + std::to_string(tick) + ")";
  }
}

void SimParticipant::Refuse(const std::string& why) {
  // The first refusal is the one to report.
  if (refusal_.empty()) refusal_ = why;
  // A run that cannot go on ends at once: nobody is asked for the present tick's answers.
  Tell(&SimLockstep::Stop, true);
}

std::string SimParticipant::SilentText() const {
  // So many are named; a robot may have thousands.
  constexpr size_t kMostSilentNamed = 3;
  // The sentence begins with their names, that of the logger first: there is but one.
  std::vector<std::string> names;
  for (const int process : machine_.silent()) {
    const bool logger = names_[process] == kLogProcess;
    names.insert(logger ? names.begin() : names.end(), names_[process]);
  }
  if (names.empty()) return "";
  const std::string text = NameFirst(names, kMostSilentNamed) +
                           (names.size() == 1 ? " does not answer" : " do not answer");
  return machine_.tick() == 0 ? text + " (the run had not begun)" : text;
}

void SimParticipant::Conclude() {
  outcome_.ticks = machine_.tick();
  outcome_.missed_deadlines = machine_.missed_deadlines();
  // The totals of the run: our own channels, and those that the modules told.
  outcome_.totals = outbox_.totals();
  for (size_t i = 0; i < options_.modules.size(); ++i) {
    const std::vector<ChannelTotal>& told = reports_[i].totals();
    outcome_.totals.insert(outcome_.totals.end(), told.begin(), told.end());
  }
  std::sort(outcome_.totals.begin(), outcome_.totals.end(),
            [](const ChannelTotal& a, const ChannelTotal& b) { return a.channel < b.channel; });
  outcome_.messages = 0;
  for (const ChannelTotal& total : outcome_.totals) outcome_.messages += total.count;
  if (options_.logger && reports_.back().complete()) {
    outcome_.recorded_hash = RunHash(reports_.back().totals());
  }
  // Without the totals of every module there is no hash of the whole run. What a module published
  // that died and left nothing behind, only the logger has.
  outcome_.run_hash = !machine_.all_modules_acknowledged() ? ""
                      : unvouched_                         ? outcome_.recorded_hash
                                                           : RunHash(outcome_.totals);
  outcome_.error = refusal_.empty() ? SilentText() : refusal_;
  if (outcome_.error.empty()) outcome_.error = Disagreement();
  outcome_.ok = outcome_.error.empty();
}

void SimParticipant::TellVerdict() {
  // The machine may still find that the logger keeps silent, so the outcome is worked out once more
  // at the end.
  Conclude();
  verdict_told_ = true;
  Say(kSimProcess, Topic::kVerdict, morphbus::verdict_t{{}, CutText(outcome_.error, kLongestText)});
}

}  // namespace morphbus::bridge
