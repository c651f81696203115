#include "bridge/lockstep/log_participant.h"

#include <algorithm>
#include <morphbus/actuator_t.hpp>
#include <morphbus/hello_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/transform_t.hpp>
#include <morphbus/world_t.hpp>
#include <utility>

namespace morphbus::bridge {
namespace {

using Kind = LogAction::Kind;
using morphbus::ask_t;

/// What the state machine needs to know of the options.
LogLockstep::Config MachineConfig(const LogParticipantOptions& options) {
  LogLockstep::Config config;
  config.passive = options.realtime;
  config.timing = options.timing;
  return config;
}

}  // namespace

/// Distinct payloads of a channel, hashed in the order of their numbers.
struct LogParticipant::ReceivedStream {
  int64_t next = 0;   ///< Number of the next payload to hash.
  int64_t count = 0;  ///< Distinct messages.
  StreamHash hash;
  std::map<int64_t, std::vector<uint8_t>> early;  ///< Bounded by the machine's window.

  void Add(int64_t sequence, const uint8_t* data, size_t size, bool in_order) {
    ++count;
    // In lockstep every gap gets filled, so a payload beyond one waits for its turn in the hash. In
    // real time nobody sends anything again, and payloads are hashed as they arrive.
    if (!in_order || sequence == next) {
      hash.Update(data, size);
      next = sequence + 1;
    } else {
      early.emplace(sequence, std::vector<uint8_t>(data, data + size));
    }
    // Whatever the new payload was holding up follows.
    while (!early.empty() && early.begin()->first == next) {
      hash.Update(early.begin()->second.data(), early.begin()->second.size());
      early.erase(early.begin());
      ++next;
    }
  }
};

LogParticipant::LogParticipant(Bus* bus, const TimeSource* time, LogParticipantOptions options,
                               Recorder record)
    : LockstepParticipant(bus, time, {options.run, std::string(kLogProcess), options.model_hash, 0},
                          MachineConfig(options)),
      options_(std::move(options)),
      record_(std::move(record)) {}

LogParticipant::~LogParticipant() = default;

void LogParticipant::OnInfoRequest(std::function<void()> publish_info) {
  publish_info_ = std::move(publish_info);
}

LogParticipant::Moment LogParticipant::CurrentMoment() const {
  // The logger has no tick of its own; it speaks of the last one that it has whole.
  return {std::max<int64_t>(0, machine_.complete_tick()), 0};
}

void LogParticipant::Start() {
  // The logger hears everything that anybody says in the run, its own messages too.
  bus_->SubscribePrefix(options_.run + "/",
                        [this](std::string_view channel, const uint8_t* data, size_t size) {
                          OnMessage(channel, data, size);
                        });
  machine_.Begin(now_us(), &actions_);
  CarryOutActions();
}

bool LogParticipant::complete() const {
  return options_.realtime ? machine_.end_seen() : machine_.complete();
}

std::vector<ChannelTotal> LogParticipant::totals() const {
  std::vector<ChannelTotal> totals;
  for (const auto& [channel, stream] : streams_) {
    totals.push_back({channel, stream->count, stream->hash.Digest(), true});
  }
  return totals;
}

std::string LogParticipant::run_hash() const { return RunHash(totals()); }

void LogParticipant::OnMessage(std::string_view channel, const uint8_t* data, size_t size) {
  // Everything on the run's channels goes to the recorder, with a note of what it is worth.
  LoggedMessage message{channel, data, size, false, false};
  const std::optional<ChannelName> name = ParseChannel(channel);
  // Foreign names on our prefix, and messages that do not decode, are bad.
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
  // The message is recorded before the machine's actions are carried out, so that nothing is
  // acknowledged that the log does not hold.
  ++(message.bad ? ledger_.bad : ledger_.received);
  if (record_) record_(message);
  CarryOutActions();
}

LogParticipant::Verdict LogParticipant::TakeHashed(const ChannelName& name,
                                                   std::string_view channel, const uint8_t* data,
                                                   size_t size) {
  morphbus::header_t header;
  if (!DecodeHeader(data, size, &header)) return Verdict::kBad;
  const Expectation expect{options_.model_hash, 0};
  Verdict verdict = Verdict::kBad;
  // Each kind of message tells the machine something else. A kind that only counts is checked and
  // not decoded, which spares its arrays.
  switch (name.topic) {
    case Topic::kClock:
      verdict = TakeClock(data, size);
      break;
    case Topic::kSensors:
      verdict = TakeSensors(header, data, size);
      break;
    case Topic::kWorld:
      if (!Check<morphbus::world_t>(data, size, expect)) return Verdict::kBad;
      verdict = machine_.OnPart(Topic::kWorld, header.sequence, header.tick, now_us(), &actions_)
                    ? Verdict::kNew
                    : Verdict::kDuplicate;
      break;
    default:
      verdict = TakeModule(name, header, data, size);
      break;
  }
  if (verdict == Verdict::kBad) return verdict;
  // Gaps and repeats go to the ledger, new payloads into the channel's hash.
  auto tracker = trackers_.find(channel);
  if (tracker == trackers_.end()) tracker = trackers_.emplace(channel, SequenceTracker()).first;
  tracker->second.Take(header.sequence, &ledger_);
  if (verdict == Verdict::kNew) AddToStream(channel, header.sequence, data, size);
  return verdict;
}

void LogParticipant::AddToStream(std::string_view channel, int64_t sequence, const uint8_t* data,
                                 size_t size) {
  // The first payload of a channel begins its hash.
  auto stream = streams_.find(channel);
  if (stream == streams_.end()) {
    stream = streams_.emplace(std::string(channel), std::make_unique<ReceivedStream>()).first;
  }
  stream->second->Add(sequence, data, size, !options_.realtime);
}

LogParticipant::Verdict LogParticipant::TakeClock(const uint8_t* data, size_t size) {
  morphbus::sim_clock_t clock;
  if (!Decode(data, size, {options_.model_hash, 0}, &clock)) return Verdict::kBad;
  // The last CLOCK says why the run ended; the first one, how many messages a tick consists of.
  if (clock.phase == morphbus::sim_clock_t::PHASE_END) end_reason_ = clock.end_reason;
  const bool fresh =
      machine_.OnClock(clock.header.tick, clock.phase, clock.num_modules, clock.num_sensors_parts,
                       clock.num_world_parts, now_us(), &actions_);
  return fresh ? Verdict::kNew : Verdict::kDuplicate;
}

LogParticipant::Verdict LogParticipant::TakeSensors(const morphbus::header_t& header,
                                                    const uint8_t* data, size_t size) {
  // Until all modules are known, SENSORS must be decoded for their names; later a check will do.
  if (!machine_.knows_all_names()) {
    morphbus::sensors_t sensors;
    if (!Decode(data, size, {options_.model_hash, 0}, &sensors)) return Verdict::kBad;
    for (const morphbus::module_sensors_t& reading : sensors.modules) {
      if (CheckModuleName(reading.name)) machine_.AddModule(reading.name);
    }
  } else if (!Check<morphbus::sensors_t>(data, size, {options_.model_hash, 0})) {
    return Verdict::kBad;
  }
  const bool fresh =
      machine_.OnPart(Topic::kSensors, header.sequence, header.tick, now_us(), &actions_);
  return fresh ? Verdict::kNew : Verdict::kDuplicate;
}

LogParticipant::Verdict LogParticipant::TakeModule(const ChannelName& name,
                                                   const morphbus::header_t& header,
                                                   const uint8_t* data, size_t size) {
  const Expectation expect{options_.model_hash, 0};
  // ACTUATOR alone says something that the machine needs to know.
  int64_t status_count = 0;
  // Only ACTUATOR is decoded; for the others a check will do.
  if (name.topic == Topic::kActuator) {
    morphbus::actuator_t actuator;
    if (!Decode(data, size, expect, &actuator)) return Verdict::kBad;
    status_count = actuator.status_count;
  } else if (name.topic == Topic::kStatus) {
    if (!Check<morphbus::status_t>(data, size, expect)) return Verdict::kBad;
  } else if (!Check<morphbus::transform_t>(data, size, expect)) {
    return Verdict::kBad;
  }
  // A module that SENSORS has not mentioned yet has no number: its message is asked for again.
  const int module = machine_.ModuleNumber(std::string(name.process));
  // Once all modules' names are known, no other module can be part of the run.
  if (module < 0 && machine_.knows_all_names()) return Verdict::kBad;
  const bool fresh = machine_.OnModule(name.topic, module, header.sequence, header.tick,
                                       status_count, now_us(), &actions_);
  return fresh ? Verdict::kNew : Verdict::kDuplicate;
}

void LogParticipant::TakeAsk(const uint8_t* data, size_t size) {
  ask_t ask;
  if (!Decode(data, size, {options_.model_hash, 0}, &ask)) return;
  // The other kinds are for the sim and for modules.
  if (ask.kind == ask_t::KIND_POLL) machine_.OnPoll(ask.header.tick, now_us(), &actions_);
  if (ask.kind == ask_t::KIND_VERDICT) TakeVerdict(ask);
  if (ask.kind == ask_t::KIND_BYE) machine_.OnBye(&actions_);
  if (ask.kind == ask_t::KIND_INFO && publish_info_) publish_info_();
}

void LogParticipant::TakeVerdict(const ask_t& ask) {
  // A verdict before END was acknowledged is none.
  machine_.OnVerdict(now_us(), &actions_);
  if (!machine_.verdict_heard()) return;
  error_ = ask.verdict;
  // Without a hash the run was stopped before all had joined; in real time loss is no failure.
  const bool comparable = !ask.run_hash.empty() && !options_.realtime;
  if (error_.empty() && comparable && ask.run_hash != run_hash()) {
    error_ = HashesDiffer(run_hash(), ask.run_hash);
  }
}

void LogParticipant::CarryOut(const LogAction& action) {
  switch (action.kind) {
    // The logger has no images and never resumes, so it names no type and no incarnation but the
    // first.
    case Kind::kHello: {
      morphbus::hello_t hello;
      hello.claim = options_.claim;
      hello.incarnation = 1;
      hello.kinematics_hash = 0;
      hello.build = options_.build;
      return SayHello(&hello);
    }
    // The sim may go on to 16 ticks beyond this one.
    case Kind::kAck: {
      ask_t ack = MakeAsk(ask_t::KIND_ACK);
      ack.acknowledged_tick = action.tick;
      return Ask(kSimProcess, &ack);
    }
    // The hash of what was recorded lets the sim compare it with what was published.
    case Kind::kEndAck: {
      ask_t ack = MakeAsk(ask_t::KIND_END_ACK);
      ack.acknowledged_tick = action.tick;
      ack.run_hash = run_hash();
      return Ask(kSimProcess, &ack);
    }
    // The machine calls modules by number; the channel is named after the module, or after the sim.
    case Kind::kAskGap: {
      const std::string from =
          action.module < 0 ? std::string(kSimProcess) : machine_.module_names()[action.module];
      return AskForResend(from, action.topic, action.first, action.last);
    }
    // Only now may the sim let everybody go.
    case Kind::kVerdictAck: {
      ask_t ack = MakeAsk(ask_t::KIND_VERDICT_ACK);
      return Ask(kSimProcess, &ack);
    }
    // A run that ended well has told us so; anything else has a reason, which error() gives.
    case Kind::kFinish:
      if (!error_.empty()) return;
      if (!complete()) {
        error_ = "the run ended before the logger had all of it";
      } else if (!machine_.verdict_heard()) {
        error_ = "the simulator left without saying how the run ended";
      }
      return;
    // Whatever was recorded so far stays, but the log is not whole.
    case Kind::kLostSim:
      error_ = "nothing heard from run '" + options_.run + "' any more";
      return;
  }
}

}  // namespace morphbus::bridge
