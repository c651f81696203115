#include "bridge/sim_party.h"

#include <algorithm>
#include <morphbus/actuator_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/world_t.hpp>
#include <utility>

#include "bridge/health.h"
#include "bridge/vm_codec.h"
#include "vm/limits.h"

namespace morphbus::bridge {
namespace {

using Kind = SimAction::Kind;
using morphbus::ask_t;
using morphbus::sim_clock_t;

SimLockstep::Config MachineConfig(const SimPartyOptions& options) {
  SimLockstep::Config config;
  config.num_modules = static_cast<int>(options.modules.size());
  config.logger = options.logger;
  config.num_ticks = options.num_ticks;
  config.tick_us = options.tick_us;
  config.realtime = options.realtime;
  config.speed = options.speed;
  config.timing = options.timing;
  return config;
}

/// Announcements a CLOCK carries at most; further ones wait for the next tick.
constexpr size_t kMostControls = 5;
constexpr size_t kMostText = 200;

}  // namespace

SimParty::SimParty(Bus* bus, SimulatedRobot* robot, const TimeSource* time, SimPartyOptions options)
    : time_(time),
      robot_(robot),
      options_(std::move(options)),
      bus_(bus),
      outbox_(bus, Speaker{options_.run, std::string(kSimProcess), options_.model_hash, 0},
              &ledger_),
      machine_(MachineConfig(options_)),
      channel_clock_(Channel(options_.run, kSimProcess, Topic::kClock)),
      channel_sensors_(Channel(options_.run, kSimProcess, Topic::kSensors)),
      channel_world_(Channel(options_.run, kSimProcess, Topic::kWorld)) {
  for (const ExpectedModule& module : options_.modules) names_.push_back(module.name);
  if (options_.logger) names_.emplace_back(kLogProcess);
  claims_.assign(names_.size(), 0);
  commands_.resize(options_.modules.size());
  for (morphbus::actuator_t& command : commands_) command.header.tick = -1;
}

SimParty::~SimParty() = default;

void SimParty::PublishHealth() {
  morphbus::health_t health = MakeHealth(std::string(kSimProcess), ledger_);
  outbox_.Send(Channel(options_.run, kSimProcess, Topic::kHealth), machine_.tick(),
               machine_.tick() * options_.tick_us, &health);
}

void SimParty::Start() {
  const auto handler = [this](void (SimParty::*method)(const uint8_t*, size_t)) {
    return [this, method](std::string_view, const uint8_t* data, size_t size) {
      (this->*method)(data, size);
    };
  };
  bus_->Subscribe(Channel(options_.run, "", Topic::kHello), handler(&SimParty::OnHello));
  bus_->Subscribe(Channel(options_.run, kSimProcess, Topic::kAsk), handler(&SimParty::OnAsk));
  for (size_t i = 0; i < options_.modules.size(); ++i) {
    bus_->Subscribe(Channel(options_.run, options_.modules[i].name, Topic::kActuator),
                    [this, i](std::string_view, const uint8_t* data, size_t size) {
                      OnActuator(i, data, size);
                    });
  }
  machine_.Begin(time_->NowUs(), &actions_);
  Settle();
}

void SimParty::OnTime() {
  ledger_.queue_overflows = bus_->queue_overflows();
  ledger_.discarded = bus_->discarded();
  ledger_.missed_deadlines = machine_.missed_deadlines();
  machine_.OnTime(time_->NowUs(), &actions_);
  Settle();
}

int64_t SimParty::next_deadline_us() const { return machine_.next_deadline_us(); }
bool SimParty::done() const { return machine_.done(); }

void SimParty::RequestStop(const std::string& reason) {
  if (outcome_.reason.empty()) outcome_.reason = reason.substr(0, kMostText);
  machine_.Stop(false, time_->NowUs(), &actions_);
  Settle();
}

void SimParty::Pause() { machine_.Pause(); }

void SimParty::Resume() {
  machine_.Resume(time_->NowUs(), &actions_);
  Settle();
}

void SimParty::Step() {
  machine_.Step(time_->NowUs(), &actions_);
  Settle();
}

void SimParty::SetSpeed(double speed) {
  machine_.SetSpeed(speed, time_->NowUs(), &actions_);
  Settle();
}

void SimParty::AnnounceControl(const std::string& text) {
  controls_.push_back(text.substr(0, kMostText));
}

void SimParty::Invoke(size_t module, const vm::InvokeRequest& request) {
  MORPHBUS_CHECK(module < options_.modules.size());
  requests_.emplace_back(module, request);
}

void SimParty::Deploy(size_t module, uint64_t hash, const std::vector<uint8_t>& image) {
  MORPHBUS_CHECK(module < options_.modules.size());
  MORPHBUS_CHECK(!image.empty() && image.size() <= vm::kMaxImageBytes);
  deployments_.push_back({module, hash, image, 0});
}

void SimParty::OnBeforeTick(std::function<void(int64_t)> hook) { before_tick_ = std::move(hook); }

std::vector<std::string> SimParty::missing_processes() const {
  std::vector<std::string> missing;
  for (size_t i = 0; i < names_.size(); ++i) {
    if (!machine_.greeted(static_cast<int>(i))) missing.push_back(names_[i]);
  }
  return missing;
}

int SimParty::ProcessNumber(const std::string& name) const {
  const auto found = std::find(names_.begin(), names_.end(), name);
  return found == names_.end() ? -1 : static_cast<int>(found - names_.begin());
}

void SimParty::OnHello(const uint8_t* data, size_t size) {
  constexpr size_t kMostTurnedAway = 16;
  morphbus::hello_t hello;
  // The model's hash is checked below, to refuse by name instead of dropping silently.
  if (!Decode(data, size, {}, &hello)) {
    ++ledger_.bad;
    return;
  }
  ++ledger_.received;
  const int process = ProcessNumber(hello.process);
  std::string why;
  if (process < 0) {
    why = "'" + hello.process + "' is not part of this run";
  } else {
    int64_t& claim = claims_[static_cast<size_t>(process)];
    if (claim == 0 && !machine_.started()) {
      if (const std::string unfit = WhyUnfit(process, hello); !unfit.empty()) return Refuse(unfit);
      claim = hello.claim;
      machine_.OnHello(process, time_->NowUs(), &actions_);
      return Settle();
    }
    if (claim == hello.claim) return;
    why = "a second process (pid " + std::to_string(hello.pid) + ") claims to be " + hello.process;
    if (!machine_.started()) return Refuse(why);
  }
  if (std::find(turned_away_.begin(), turned_away_.end(), why) != turned_away_.end()) return;
  if (turned_away_.size() < kMostTurnedAway) turned_away_.push_back(why);
}

void SimParty::OnActuator(size_t module, const uint8_t* data, size_t size) {
  morphbus::actuator_t command;
  const ExpectedModule& expected = options_.modules[module];
  if (!Decode(data, size, {options_.model_hash, 0}, &command) ||
      command.module_id != static_cast<int16_t>(expected.id) ||
      (module < sensed_.size() && command.num_joints != sensed_[module].num_joints)) {
    ++ledger_.bad;
    return;
  }
  ++ledger_.received;
  trackers_[expected.name].Take(command.header.sequence, &ledger_);
  if (command.header.tick != machine_.tick()) return;
  if (commands_[module].header.tick == command.header.tick) return;
  const int64_t tick = command.header.tick;
  commands_[module] = std::move(command);
  machine_.OnActuator(static_cast<int>(module), tick, time_->NowUs(), &actions_);
  Settle();
}

void SimParty::OnAsk(const uint8_t* data, size_t size) {
  ask_t ask;
  if (!Decode(data, size, {options_.model_hash, 0}, &ask)) {
    ++ledger_.bad;
    return;
  }
  ++ledger_.received;
  const int process = ProcessNumber(ask.from);
  if (ask.kind == ask_t::KIND_RESEND) {
    outbox_.Resend(ask.channel, ask.first_sequence, ask.last_sequence);
  } else if (ask.kind == ask_t::KIND_ACK && ask.from == kLogProcess) {
    machine_.OnLogAck(ask.acknowledged_tick, time_->NowUs(), &actions_);
  } else if (ask.kind == ask_t::KIND_END_ACK && process >= 0) {
    TakeEndAck(process, ask);
  }
  Settle();
}

void SimParty::TakeEndAck(int process, const ask_t& ask) {
  if (ask.from == kLogProcess) {
    outcome_.recorded_hash = ask.run_hash;
  } else {
    for (const morphbus::channel_total_t& total : ask.totals) {
      const std::optional<ChannelName> name = ParseChannel(total.channel);
      if (!name || name->run != options_.run || name->process != ask.from) continue;
      module_totals_[total.channel] = {total.channel, total.count,
                                       static_cast<uint64_t>(total.hash), IsHashed(name->topic)};
    }
  }
  machine_.OnEndAck(process, time_->NowUs(), &actions_);
}

void SimParty::Settle() {
  if (working_) return;  // A wish's consequence: the loop below comes to it.
  working_ = true;
  for (size_t i = 0; i < actions_.size(); ++i) {
    const SimAction action = actions_[i];
    Do(action);
  }
  actions_.clear();
  working_ = false;
}

void SimParty::Do(const SimAction& action) {
  switch (action.kind) {
    case Kind::kPublishTick:
      PublishTick(action.tick);
      return machine_.OnPublished(time_->NowUs());
    case Kind::kRepeatTick:
      Repeat(channel_clock_, action.tick, 1);
      return Repeat(channel_sensors_, action.tick, static_cast<int>(sensors_parts_.size()));
    case Kind::kAdvance:
      return Advance();
    case Kind::kAskModule: {
      const std::string& name = names_[static_cast<size_t>(action.process)];
      const std::string channel = Channel(options_.run, name, Topic::kActuator);
      // In lockstep the number is the tick; in real time nobody asks.
      return Ask(name, ask_t::KIND_RESEND, channel, action.tick);
    }
    case Kind::kPollLogger:
      return Ask(std::string(kLogProcess), ask_t::KIND_POLL, "", 0);
    case Kind::kPublishEnd:
      return PublishClock(action.tick, sim_clock_t::PHASE_END);
    case Kind::kRepeatEnd: {
      const int64_t last = outbox_.count(channel_clock_) - 1;
      outbox_.Resend(channel_clock_, last, last);
      return;
    }
    case Kind::kBye:
      // Not acknowledged, hence several: who misses all of them leaves after a second of silence.
      for (int i = 0; i < 4; ++i) {
        for (const std::string& name : names_) Ask(name, ask_t::KIND_BYE, "", 0);
      }
      return;
    case Kind::kFinish:
      return Finish();
  }
}

void SimParty::Repeat(const std::string& channel, int64_t tick, int parts) {
  outbox_.Resend(channel, tick * parts, tick * parts + parts - 1);
}

void SimParty::PublishTick(int64_t tick) {
  if (before_tick_) before_tick_(tick);
  robot_->Sense(&sensed_);
  robot_->Truth(&truth_);
  if (const std::string why = WhyUnusable(); !why.empty()) {
    return Refuse(why + " (tick " + std::to_string(tick) + ")");
  }
  if (sensors_parts_.empty()) {
    std::vector<int> most_docked;
    for (const ExpectedModule& module : options_.modules) {
      most_docked.push_back(module.num_connectors);
    }
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
  PublishClock(tick, machine_.started() ? sim_clock_t::PHASE_RUN : sim_clock_t::PHASE_START);
  PublishSensors(tick);
  PublishWorld(tick);
}

void SimParty::PublishSensors(int64_t tick) {
  morphbus::sensors_t sensors;
  sensors.num_parts = static_cast<int16_t>(sensors_parts_.size());
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
void SimParty::AddOrders(size_t part, morphbus::sensors_t* sensors) {
  const std::vector<size_t>& members = sensors_parts_[part];
  const auto here = [&members](size_t module) {
    return std::find(members.begin(), members.end(), module) != members.end();
  };
  sensors->requests.clear();
  while (!requests_.empty() && here(requests_.front().first) &&
         sensors->requests.size() < static_cast<size_t>(vm::kMaxRequests)) {
    ToRequest(requests_.front().second, options_.modules[requests_.front().first].id,
              &sensors->requests.emplace_back());
    requests_.pop_front();
  }
  sensors->num_requests = static_cast<int8_t>(sensors->requests.size());
  sensors->pieces.clear();
  if (!deployments_.empty() && here(deployments_.front().module)) {
    Deployment& deployment = deployments_.front();
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

void SimParty::PublishClock(int64_t tick, int8_t phase) {
  sim_clock_t clock;
  clock.phase = phase;
  clock.tick_us = options_.tick_us;
  clock.num_modules = static_cast<int16_t>(options_.modules.size());
  clock.num_sensors_parts = static_cast<int16_t>(sensors_parts_.size());
  clock.num_world_parts = static_cast<int16_t>(world_parts_);
  if (phase == sim_clock_t::PHASE_END) {
    if (outcome_.reason.empty()) {
      outcome_.reason = outcome_.error.empty() ? "finished" : outcome_.error.substr(0, kMostText);
    }
    clock.end_reason = outcome_.reason;
  }
  const size_t controls = std::min(controls_.size(), kMostControls);
  clock.num_controls = static_cast<int16_t>(controls);
  clock.controls.assign(controls_.begin(),
                        controls_.begin() + static_cast<std::ptrdiff_t>(controls));
  controls_.erase(controls_.begin(), controls_.begin() + static_cast<std::ptrdiff_t>(controls));
  outbox_.Send(channel_clock_, tick, tick * options_.tick_us, &clock);
}

void SimParty::PublishWorld(int64_t tick) {
  morphbus::world_t world;
  world.num_parts = static_cast<int16_t>(world_parts_);
  const size_t per_part = WorldBodiesPerPart();
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

void SimParty::Advance() {
  for (morphbus::actuator_t& command : commands_) {
    if (command.header.tick < 0) continue;  // Real time: this one came too late.
    robot_->Actuate(command);
    command.header.tick = -1;
  }
  robot_->Advance();
}

void SimParty::Ask(const std::string& to, int8_t kind, const std::string& channel,
                   int64_t sequence) {
  ask_t ask;
  ask.from = kSimProcess;
  ask.kind = kind;
  ask.channel = channel;
  ask.first_sequence = ask.last_sequence = sequence;
  ask.acknowledged_tick = -1;
  ask.num_totals = 0;
  if (kind != ask_t::KIND_BYE) ++ledger_.asked;
  outbox_.Send(Channel(options_.run, to, Topic::kAsk), machine_.tick(),
               machine_.tick() * options_.tick_us, &ask);
}

void SimParty::Refuse(const std::string& why) {
  if (outcome_.error.empty()) outcome_.error = why;
  machine_.Stop(true, time_->NowUs(), &actions_);
  Settle();
}

void SimParty::Finish() {
  outcome_.ticks = machine_.tick();
  outcome_.missed_deadlines = machine_.missed_deadlines();
  if (outcome_.error.empty() && !machine_.silent().empty()) {
    std::string names;
    for (const int process : machine_.silent()) {
      names += (names.empty() ? "" : ", ") + names_[static_cast<size_t>(process)];
    }
    outcome_.error = names + (machine_.silent().size() == 1 ? " does" : " do") + " not answer";
    if (outcome_.ticks == 0) outcome_.error += " (the run had not begun)";
  }
  outcome_.ok = outcome_.error.empty();
  outcome_.totals = outbox_.totals();
  for (const auto& [channel, total] : module_totals_) outcome_.totals.push_back(total);
  std::sort(outcome_.totals.begin(), outcome_.totals.end(),
            [](const ChannelTotal& a, const ChannelTotal& b) { return a.channel < b.channel; });
  outcome_.run_hash = RunHash(outcome_.totals);
  for (const ChannelTotal& total : outcome_.totals) outcome_.messages += total.count;
}

}  // namespace morphbus::bridge
