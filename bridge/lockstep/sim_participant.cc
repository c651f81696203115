#include "bridge/lockstep/sim_participant.h"

#include <algorithm>
#include <morphbus/actuator_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/world_t.hpp>
#include <utility>

#include "bridge/wire/vm_codec.h"
#include "vm/limits.h"

namespace morphbus::bridge {
namespace {

using Kind = SimAction::Kind;
using morphbus::ask_t;
using morphbus::sim_clock_t;

/// What the state machine needs to know of the options.
SimLockstep::Config MachineConfig(const SimParticipantOptions& options) {
  SimLockstep::Config config = options;
  config.num_modules = static_cast<int>(options.modules.size());
  return config;
}

/// Announcements a CLOCK carries at most; further ones wait for the next tick.
constexpr size_t kMostControls = 5;

}  // namespace

SimParticipant::SimParticipant(Bus* bus, SimulatedRobot* robot, const TimeSource* time,
                               SimParticipantOptions options)
    : LockstepParticipant(bus, time, {options.run, std::string(kSimProcess), options.model_hash, 0},
                          MachineConfig(options)),
      robot_(robot),
      options_(std::move(options)),
      channel_clock_(Channel(options_.run, kSimProcess, Topic::kClock)),
      channel_sensors_(Channel(options_.run, kSimProcess, Topic::kSensors)),
      channel_world_(Channel(options_.run, kSimProcess, Topic::kWorld)) {
  // The machine calls processes by number: the modules in order of id, then the logger.
  for (const ExpectedModule& module : options_.modules) names_.push_back(module.name);
  if (options_.logger) names_.emplace_back(kLogProcess);
  claims_.assign(names_.size(), 0);
  commands_.resize(options_.modules.size());
  // No command has come for any tick yet.
  for (morphbus::actuator_t& command : commands_) {
    command.header.tick = -1;
    command.header.program_hash = 0;
  }
}

void SimParticipant::Start() {
  // HELLO and ASK have one channel for all senders, ACTUATOR one for each module.
  Listen(ChannelOf("", Topic::kHello), &SimParticipant::OnHello);
  Listen(ChannelOf(kSimProcess, Topic::kAsk), &SimParticipant::OnAsk);
  for (size_t i = 0; i < options_.modules.size(); ++i) {
    Listen(ChannelOf(options_.modules[i].name, Topic::kActuator), &SimParticipant::OnActuator, i);
  }
  // From here on HELLOs are awaited; tick 0 goes out at once, for all that are listening already.
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

void SimParticipant::Invoke(size_t module, const vm::InvokeRequest& request) {
  MORPHBUS_CHECK(module < options_.modules.size());
  requests_.emplace_back(module, request);
}

void SimParticipant::Deploy(size_t module, uint64_t hash, const std::vector<uint8_t>& image) {
  MORPHBUS_CHECK(module < options_.modules.size());
  MORPHBUS_CHECK(!image.empty() && image.size() <= vm::kMaxImageBytes);
  deployments_.push_back({module, hash, image, 0});
}

std::vector<std::string> SimParticipant::missing_processes() const {
  std::vector<std::string> missing;
  for (size_t i = 0; i < names_.size(); ++i) {
    if (!machine_.greeted(static_cast<int>(i))) missing.push_back(names_[i]);
  }
  return missing;
}

int SimParticipant::ProcessNumber(const std::string& name) const {
  const auto found = std::find(names_.begin(), names_.end(), name);
  return found == names_.end() ? -1 : static_cast<int>(found - names_.begin());
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
      return Tell(&SimLockstep::OnHello, process);
    }
    // The same process says HELLO again until it hears CLOCK.
    if (claim == hello.claim) return;
    why = "a second process (pid " + std::to_string(hello.pid) + ") claims to be " + hello.process;
    if (!machine_.started()) return Refuse(why);
  }
  // A process that tries again and again is listed once.
  if (std::find(turned_away_.begin(), turned_away_.end(), why) != turned_away_.end()) return;
  if (turned_away_.size() < kMostTurnedAway) turned_away_.push_back(why);
}

void SimParticipant::OnActuator(size_t module, const uint8_t* data, size_t size) {
  morphbus::actuator_t command;
  // A command must be of the module whose channel it came on, and for all of its joints.
  const ExpectedModule& expected = options_.modules[module];
  const auto fits = [&] {
    return command.module_id == static_cast<int16_t>(expected.id) &&
           (module >= sensed_.size() || command.num_joints == sensed_[module].num_joints);
  };
  if (!Accept(data, size, &command, fits)) return;
  // Old and repeated commands count in the ledger; only the first one of this tick is used.
  trackers_[expected.name].Take(command.header.sequence, &ledger_);
  if (command.header.tick != machine_.tick()) return;
  if (commands_[module].header.tick == command.header.tick) return;
  // The command is kept until everybody has answered; only then does the robot move.
  const int64_t tick = command.header.tick;
  commands_[module] = std::move(command);
  Tell(&SimLockstep::OnActuator, static_cast<int>(module), tick);
}

void SimParticipant::OnAsk(const uint8_t* data, size_t size) {
  ask_t ask;
  if (!Accept(data, size, &ask)) return;
  // What only the logger or a module of the run may say is believed of nobody else.
  const int process = ProcessNumber(ask.sender);
  if (ask.kind == ask_t::KIND_RESEND) {
    outbox_.Resend(ask.channel, ask.first_sequence, ask.last_sequence);
  } else if (ask.kind == ask_t::KIND_ACK && ask.sender == kLogProcess) {
    Tell(&SimLockstep::OnLogAck, ask.acknowledged_tick);
  } else if (ask.kind == ask_t::KIND_END_ACK && process >= 0) {
    TakeEndAck(process, ask);
  } else if (ask.kind == ask_t::KIND_VERDICT_ACK && ask.sender == kLogProcess) {
    Tell(&SimLockstep::OnVerdictAck);
  }
}

void SimParticipant::TakeEndAck(int process, const ask_t& ask) {
  if (ask.sender == kLogProcess) {
    outcome_.recorded_hash = ask.run_hash;
  } else {
    // A module speaks for its own channels only.
    for (const morphbus::channel_total_t& total : ask.totals) {
      const std::optional<ChannelName> name = ParseChannel(total.channel);
      if (!name || name->run != options_.run || name->process != ask.sender) continue;
      module_totals_[total.channel] = {total.channel, total.count,
                                       static_cast<uint64_t>(total.hash), IsHashed(name->topic)};
    }
  }
  Tell(&SimLockstep::OnEndAck, process);
}

void SimParticipant::CarryOut(const SimAction& action) {
  switch (action.kind) {
    // Sensing takes a while, during which nobody else is late.
    case Kind::kPublishTick:
      PublishTick(action.tick);
      machine_.OnPublished(now_us());
      if (after_tick_) after_tick_(action.tick);
      return;
    // WORLD is not repeated: only the logger needs it, and asks for what it lacks.
    case Kind::kRepeatTick:
      Repeat(channel_clock_, action.tick, 1);
      return Repeat(channel_sensors_, action.tick, static_cast<int>(sensors_parts_.size()));
    case Kind::kAdvance:
      return Advance();
    case Kind::kAskModule:
      // In lockstep the number is the tick; in real time nobody asks.
      return AskForResend(names_[action.process], Topic::kActuator, action.tick, action.tick);
    // The header of the request says at which tick the sim is.
    case Kind::kPollLogger:
      ++ledger_.asked;
      return Ask(kLogProcess, MakeAsk(ask_t::KIND_POLL));
    case Kind::kPublishEnd:
      return PublishClock(action.tick, sim_clock_t::PHASE_END);
    // END is the last message on CLOCK.
    case Kind::kRepeatEnd: {
      const int64_t last = outbox_.count(channel_clock_) - 1;
      outbox_.Resend(channel_clock_, last, last);
      return;
    }
    case Kind::kTellVerdict:
      return TellVerdict();
    case Kind::kBye:
      // Not acknowledged, hence several: who misses all of them leaves after a second of silence.
      for (int i = 0; i < 4; ++i) {
        for (const std::string& name : names_) Ask(name, MakeAsk(ask_t::KIND_BYE));
      }
      return;
    case Kind::kFinish:
      return Conclude();
  }
}

void SimParticipant::Repeat(const std::string& channel, int64_t tick, int parts) {
  // Sequence numbers on CLOCK, SENSORS and WORLD follow from the tick.
  outbox_.Resend(channel, tick * parts, tick * parts + parts - 1);
}

void SimParticipant::PublishTick(int64_t tick) {
  // Controls take effect before the sensors of the tick are read.
  if (before_tick_) before_tick_(tick);
  // Everybody's readings are of the same moment.
  robot_->Sense(&sensed_);
  robot_->Truth(&truth_);
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
    size_t most_bodies = truth_.size();
    if (!truth_.empty()) {
      // Each joint can come to part two bodies, should connections open.
      size_t links = 0;
      for (const auto& reading : sensed_) links += static_cast<size_t>(reading.num_joints) + 1;
      most_bodies = std::max(most_bodies, links);
    }
    const size_t per_part = WorldBodiesPerPart();
    world_parts_ = static_cast<int>((most_bodies + per_part - 1) / per_part);
  }
  // CLOCK goes first, so that listeners know how many parts of the others to expect.
  PublishClock(tick, machine_.started() ? sim_clock_t::PHASE_RUN : sim_clock_t::PHASE_START);
  PublishSensors(tick);
  PublishWorld(tick);
}

void SimParticipant::PublishSensors(int64_t tick) {
  morphbus::sensors_t sensors;
  sensors.num_parts = static_cast<int16_t>(sensors_parts_.size());
  // Each part goes out with the orders for its modules.
  for (size_t part = 0; part < sensors_parts_.size(); ++part) {
    sensors.part = static_cast<int16_t>(part);
    sensors.num_modules = static_cast<int16_t>(sensors_parts_[part].size());
    sensors.modules.clear();
    for (const size_t i : sensors_parts_[part]) sensors.modules.push_back(sensed_[i]);
    AddOrders(part, &sensors);
    outbox_.Send(channel_sensors_, tick, tick * options_.tick_us, &sensors);
  }
}

/// Requests and pieces for the modules of this part, as many as there is room for.
void SimParticipant::AddOrders(size_t part, morphbus::sensors_t* sensors) {
  const std::vector<size_t>& members = sensors_parts_[part];
  const auto here = [&members](size_t module) {
    return std::find(members.begin(), members.end(), module) != members.end();
  };
  // Requests leave in the order they came in; the first one that is for another part holds up the
  // rest.
  sensors->requests.clear();
  while (!requests_.empty() && here(requests_.front().first) &&
         sensors->requests.size() < static_cast<size_t>(vm::kMaxRequests)) {
    ToRequest(requests_.front().second, options_.modules[requests_.front().first].id,
              &sensors->requests.emplace_back());
    requests_.pop_front();
  }
  sensors->num_requests = static_cast<int8_t>(sensors->requests.size());
  // One piece a tick keeps SENSORS within a datagram.
  sensors->pieces.clear();
  if (!deployments_.empty() && here(deployments_.front().module)) {
    Deployment& deployment = deployments_.front();
    // The next bytes of the first program that waits, with all that a receiver needs to place them.
    const size_t size = std::min(kMaxDeployPiece, deployment.image.size() - deployment.sent);
    morphbus::deploy_piece_t& piece = sensors->pieces.emplace_back();
    piece.module_id = static_cast<int16_t>(options_.modules[deployment.module].id);
    piece.hash = static_cast<int64_t>(deployment.hash);
    piece.image_size = static_cast<int32_t>(deployment.image.size());
    piece.offset = static_cast<int32_t>(deployment.sent);
    piece.size = static_cast<int16_t>(size);
    const uint8_t* from = deployment.image.data() + deployment.sent;
    piece.bytes.assign(from, from + size);
    deployment.sent += size;
    if (deployment.sent == deployment.image.size()) deployments_.pop_front();
  }
  sensors->num_pieces = static_cast<int8_t>(sensors->pieces.size());
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
    if (outcome_.reason.empty()) {
      outcome_.reason = wrong.empty() ? "finished" : CutText(wrong, kLongestText);
    }
    clock.end_reason = outcome_.reason;
  }
  // Controls that do not fit wait for the next CLOCK.
  const size_t controls = std::min(controls_.size(), kMostControls);
  clock.num_controls = static_cast<int16_t>(controls);
  clock.controls.assign(controls_.begin(),
                        controls_.begin() + static_cast<std::ptrdiff_t>(controls));
  controls_.erase(controls_.begin(), controls_.begin() + static_cast<std::ptrdiff_t>(controls));
  outbox_.Send(channel_clock_, tick, tick * options_.tick_us, &clock);
}

void SimParticipant::PublishWorld(int64_t tick) {
  morphbus::world_t world;
  world.num_parts = static_cast<int16_t>(world_parts_);
  const size_t per_part = WorldBodiesPerPart();
  // Parts beyond the last body are sent empty, since their number is constant.
  for (int part = 0; part < world_parts_; ++part) {
    const size_t from = std::min(truth_.size(), static_cast<size_t>(part) * per_part);
    const size_t to = std::min(truth_.size(), from + per_part);
    world.part = static_cast<int16_t>(part);
    world.num_bodies = static_cast<int16_t>(to - from);
    world.bodies.assign(truth_.begin() + static_cast<std::ptrdiff_t>(from),
                        truth_.begin() + static_cast<std::ptrdiff_t>(to));
    outbox_.Send(channel_world_, tick, tick * options_.tick_us, &world);
  }
}

void SimParticipant::Advance() {
  for (morphbus::actuator_t& command : commands_) {
    if (command.header.tick < 0) continue;  // Real time: this one came too late.
    // In order of modules, whatever the order of arrival, so that the robot moves the same every
    // time.
    robot_->Actuate(command);
    command.header.tick = -1;
  }
  robot_->Advance();
}

void SimParticipant::Refuse(const std::string& why) {
  // The first refusal is the one to report.
  if (refusal_.empty()) refusal_ = why;
  // A run that cannot go on ends at once: nobody is asked for the present tick's answers.
  Tell(&SimLockstep::Stop, true);
}

std::string SimParticipant::SilentText() const {
  std::string names;
  // The sentence begins with their names.
  for (const int process : machine_.silent())
    names += (names.empty() ? "" : ", ") + names_[process];
  if (names.empty()) return names;
  names += machine_.silent().size() == 1 ? " does not answer" : " do not answer";
  return machine_.tick() == 0 ? names + " (the run had not begun)" : names;
}

void SimParticipant::Conclude() {
  outcome_.ticks = machine_.tick();
  outcome_.missed_deadlines = machine_.missed_deadlines();
  // The totals of the run: our own channels, and those that the modules told with KIND_END_ACK.
  outcome_.totals = outbox_.totals();
  for (const auto& [channel, total] : module_totals_) outcome_.totals.push_back(total);
  std::sort(outcome_.totals.begin(), outcome_.totals.end(),
            [](const ChannelTotal& a, const ChannelTotal& b) { return a.channel < b.channel; });
  outcome_.messages = 0;
  for (const ChannelTotal& total : outcome_.totals) outcome_.messages += total.count;
  // Without the totals of every module there is no hash of the whole run.
  outcome_.run_hash = machine_.all_modules_acknowledged() ? RunHash(outcome_.totals) : "";
  outcome_.error = refusal_.empty() ? SilentText() : refusal_;
  // In real time the logger only listens, and what it misses is counted; in lockstep it has all.
  const bool comparable = !options_.realtime && !outcome_.run_hash.empty();
  if (outcome_.error.empty() && comparable && !outcome_.recorded_hash.empty() &&
      outcome_.recorded_hash != outcome_.run_hash) {
    outcome_.error = HashesDiffer(outcome_.recorded_hash, outcome_.run_hash);
  }
  outcome_.ok = outcome_.error.empty();
}

void SimParticipant::TellVerdict() {
  // The machine may still find that the logger keeps silent, so the outcome is worked out once more
  // at the end.
  Conclude();
  ask_t verdict = MakeAsk(ask_t::KIND_VERDICT);
  verdict.run_hash = outcome_.run_hash;
  verdict.verdict = CutText(outcome_.error, kLongestText);
  Ask(kLogProcess, std::move(verdict));
}

}  // namespace morphbus::bridge
