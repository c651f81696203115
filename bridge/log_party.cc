#include "bridge/log_party.h"

#include <unistd.h>

#include <algorithm>
#include <morphbus/actuator_t.hpp>
#include <morphbus/hello_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/transform_t.hpp>
#include <morphbus/world_t.hpp>
#include <utility>

#include "bridge/health.h"

namespace morphbus::bridge {
namespace {

using Kind = LogAction::Kind;
using morphbus::ask_t;

LogLockstep::Config MachineConfig(const LogPartyOptions& options) {
  LogLockstep::Config config;
  config.passive = options.realtime;
  config.timing = options.timing;
  return config;
}

Topic TopicOf(LogAction::Line line) {
  switch (line) {
    case LogAction::Line::kClock:
      return Topic::kClock;
    case LogAction::Line::kSensors:
      return Topic::kSensors;
    case LogAction::Line::kWorld:
      return Topic::kWorld;
    case LogAction::Line::kTransform:
      return Topic::kTransform;
    case LogAction::Line::kActuator:
      return Topic::kActuator;
    case LogAction::Line::kStatus:
      break;
  }
  return Topic::kStatus;
}

}  // namespace

struct LogParty::Line {
  int64_t next = 0;   ///< Number of the next payload to hash.
  int64_t count = 0;  ///< Distinct messages.
  StreamHash hash;
  std::map<int64_t, std::vector<uint8_t>> early;  ///< Bounded by the machine's window.

  void Add(int64_t sequence, const uint8_t* data, size_t size, bool in_order) {
    ++count;
    if (!in_order || sequence == next) {
      hash.Update(data, size);
      next = sequence + 1;
    } else {
      early.emplace(sequence, std::vector<uint8_t>(data, data + size));
    }
    while (!early.empty() && early.begin()->first == next) {
      hash.Update(early.begin()->second.data(), early.begin()->second.size());
      early.erase(early.begin());
      ++next;
    }
  }
};

LogParty::LogParty(Bus* bus, const TimeSource* time, LogPartyOptions options, Recorder record)
    : time_(time),
      options_(std::move(options)),
      record_(std::move(record)),
      bus_(bus),
      outbox_(bus, Speaker{options_.run, std::string(kLogProcess), options_.model_hash, 0},
              &ledger_),
      machine_(MachineConfig(options_)) {}

LogParty::~LogParty() = default;

void LogParty::OnInfoRequest(std::function<void()> publish_info) {
  publish_info_ = std::move(publish_info);
}

void LogParty::PublishHealth() {
  morphbus::health_t health = MakeHealth(std::string(kLogProcess), ledger_);
  outbox_.Send(Channel(options_.run, kLogProcess, Topic::kHealth),
               std::max<int64_t>(0, machine_.complete_tick()), 0, &health);
}

void LogParty::Start() {
  bus_->SubscribePrefix(options_.run + "/",
                        [this](std::string_view channel, const uint8_t* data, size_t size) {
                          OnMessage(channel, data, size);
                        });
  machine_.Begin(time_->NowUs(), &actions_);
  Settle();
}

void LogParty::OnTime() {
  ledger_.queue_overflows = bus_->queue_overflows();
  ledger_.discarded = bus_->discarded();
  machine_.OnTime(time_->NowUs(), &actions_);
  Settle();
}

int64_t LogParty::next_deadline_us() const { return machine_.next_deadline_us(); }
bool LogParty::done() const { return machine_.done(); }
bool LogParty::complete() const { return machine_.complete(); }

std::vector<ChannelTotal> LogParty::totals() const {
  std::vector<ChannelTotal> totals;
  for (const auto& [channel, line] : lines_) {
    totals.push_back({channel, line->count, line->hash.Digest(), true});
  }
  return totals;
}

std::string LogParty::run_hash() const { return RunHash(totals()); }

void LogParty::OnMessage(std::string_view channel, const uint8_t* data, size_t size) {
  LoggedMessage message{channel, data, size, false, false};
  const std::optional<ChannelName> name = ParseChannel(channel);
  if (!name || name->run != options_.run) {
    message.bad = true;
  } else if (IsHashed(name->topic)) {
    const Verdict verdict = TakeHashed(*name, channel, data, size);
    message.duplicate = verdict == Verdict::kDuplicate;
    message.bad = verdict == Verdict::kBad;
  } else {
    morphbus::header_t header;
    message.bad = !DecodeHeader(data, size, &header);
    if (!message.bad && name->topic == Topic::kAsk && name->process == kLogProcess) {
      TakeAsk(data, size);
    }
  }
  ++(message.bad ? ledger_.bad : ledger_.received);
  if (record_) record_(message);
  Settle();
}

LogParty::Verdict LogParty::TakeHashed(const ChannelName& name, std::string_view channel,
                                       const uint8_t* data, size_t size) {
  morphbus::header_t header;
  if (!DecodeHeader(data, size, &header)) return Verdict::kBad;
  const Expectation expect{options_.model_hash, 0};
  Verdict verdict = Verdict::kBad;
  switch (name.topic) {
    case Topic::kClock:
      verdict = TakeClock(data, size);
      break;
    case Topic::kSensors:
      verdict = TakeSensors(header, data, size);
      break;
    case Topic::kWorld:
      if (!Check<morphbus::world_t>(data, size, expect)) return Verdict::kBad;
      verdict = machine_.OnPart(LogLockstep::Line::kWorld, header.sequence, header.tick,
                                time_->NowUs(), &actions_)
                    ? Verdict::kNew
                    : Verdict::kDuplicate;
      break;
    default:
      verdict = TakeModule(name, header, data, size);
      break;
  }
  if (verdict == Verdict::kBad) return verdict;
  auto tracker = trackers_.find(channel);
  if (tracker == trackers_.end()) tracker = trackers_.emplace(channel, SequenceTracker()).first;
  tracker->second.Take(header.sequence, &ledger_);
  if (verdict == Verdict::kNew) AddToLine(channel, header.sequence, data, size);
  return verdict;
}

void LogParty::AddToLine(std::string_view channel, int64_t sequence, const uint8_t* data,
                         size_t size) {
  auto line = lines_.find(channel);
  if (line == lines_.end()) {
    line = lines_.emplace(std::string(channel), std::make_unique<Line>()).first;
  }
  line->second->Add(sequence, data, size, !options_.realtime);
}

LogParty::Verdict LogParty::TakeClock(const uint8_t* data, size_t size) {
  morphbus::sim_clock_t clock;
  if (!Decode(data, size, {options_.model_hash, 0}, &clock)) return Verdict::kBad;
  if (clock.phase == morphbus::sim_clock_t::PHASE_END) end_reason_ = clock.end_reason;
  const bool fresh =
      machine_.OnClock(clock.header.tick, clock.phase, clock.num_modules, clock.num_sensors_parts,
                       clock.num_world_parts, time_->NowUs(), &actions_);
  return fresh ? Verdict::kNew : Verdict::kDuplicate;
}

LogParty::Verdict LogParty::TakeSensors(const morphbus::header_t& header, const uint8_t* data,
                                        size_t size) {
  if (!machine_.knows_all_names()) {
    morphbus::sensors_t sensors;
    if (!Decode(data, size, {options_.model_hash, 0}, &sensors)) return Verdict::kBad;
    for (const morphbus::module_sensors_t& reading : sensors.modules) {
      if (CheckModuleName(reading.name)) machine_.AddModule(reading.name);
    }
  } else if (!Check<morphbus::sensors_t>(data, size, {options_.model_hash, 0})) {
    return Verdict::kBad;
  }
  const bool fresh = machine_.OnPart(LogLockstep::Line::kSensors, header.sequence, header.tick,
                                     time_->NowUs(), &actions_);
  return fresh ? Verdict::kNew : Verdict::kDuplicate;
}

LogParty::Verdict LogParty::TakeModule(const ChannelName& name, const morphbus::header_t& header,
                                       const uint8_t* data, size_t size) {
  const Expectation expect{options_.model_hash, 0};
  LogLockstep::Line line = LogLockstep::Line::kTransform;
  int64_t status_count = 0;
  if (name.topic == Topic::kActuator) {
    line = LogLockstep::Line::kActuator;
    morphbus::actuator_t actuator;
    if (!Decode(data, size, expect, &actuator)) return Verdict::kBad;
    status_count = actuator.status_count;
  } else if (name.topic == Topic::kStatus) {
    line = LogLockstep::Line::kStatus;
    if (!Check<morphbus::status_t>(data, size, expect)) return Verdict::kBad;
  } else if (!Check<morphbus::transform_t>(data, size, expect)) {
    return Verdict::kBad;
  }
  const int module = machine_.ModuleNumber(std::string(name.process));
  // With all names known, another one is an impostor's.
  if (module < 0 && machine_.knows_all_names()) return Verdict::kBad;
  const bool fresh = machine_.OnModule(line, module, header.sequence, header.tick, status_count,
                                       time_->NowUs(), &actions_);
  return fresh ? Verdict::kNew : Verdict::kDuplicate;
}

void LogParty::TakeAsk(const uint8_t* data, size_t size) {
  ask_t ask;
  if (!Decode(data, size, {options_.model_hash, 0}, &ask)) return;
  if (ask.kind == ask_t::KIND_POLL) machine_.OnPoll(ask.header.tick, time_->NowUs(), &actions_);
  if (ask.kind == ask_t::KIND_BYE) machine_.OnBye(&actions_);
  if (ask.kind == ask_t::KIND_INFO && publish_info_) publish_info_();
}

void LogParty::Settle() {
  if (working_) return;  // A wish's consequence: the loop below comes to it.
  working_ = true;
  for (size_t i = 0; i < actions_.size(); ++i) {
    const LogAction action = actions_[i];
    Do(action);
  }
  actions_.clear();
  working_ = false;
}

void LogParty::Do(const LogAction& action) {
  ask_t ask;
  switch (action.kind) {
    case Kind::kHello:
      return SayHello();
    case Kind::kAck:
      ask.kind = ask_t::KIND_ACK;
      ask.acknowledged_tick = action.tick;
      return Ask(std::string(kSimProcess), &ask);
    case Kind::kEndAck:
      ask.kind = ask_t::KIND_END_ACK;
      ask.acknowledged_tick = action.tick;
      ask.run_hash = run_hash();
      return Ask(std::string(kSimProcess), &ask);
    case Kind::kAskGap: {
      const std::string to = action.module < 0
                                 ? std::string(kSimProcess)
                                 : machine_.module_names()[static_cast<size_t>(action.module)];
      ask.kind = ask_t::KIND_RESEND;
      ask.channel = Channel(options_.run, to, TopicOf(action.line));
      ask.first_sequence = action.first;
      ask.last_sequence = action.last;
      ask.acknowledged_tick = -1;
      ++ledger_.asked;
      return Ask(to, &ask);
    }
    case Kind::kFinish:
      if (!machine_.complete() && !options_.realtime) {
        error_ = "the run ended before the logger had all of it";
      }
      return;
    case Kind::kLostSim:
      error_ = "nothing heard from run '" + options_.run + "' any more";
      return;
  }
}

void LogParty::Ask(const std::string& to, ask_t* ask) {
  ask->from = kLogProcess;
  if (ask->kind != ask_t::KIND_RESEND) ask->first_sequence = ask->last_sequence = 0;
  ask->num_totals = 0;
  outbox_.Send(Channel(options_.run, to, Topic::kAsk),
               std::max<int64_t>(0, machine_.complete_tick()), 0, ask);
}

void LogParty::SayHello() {
  morphbus::hello_t hello;
  hello.process = kLogProcess;
  hello.pid = getpid();
  hello.claim = options_.claim;
  hello.incarnation = 1;
  hello.kinematics_hash = 0;
  hello.wire_hash = static_cast<int64_t>(WireHash());
  hello.build = options_.build;
  outbox_.Send(Channel(options_.run, "", Topic::kHello), 0, 0, &hello);
}

}  // namespace morphbus::bridge
