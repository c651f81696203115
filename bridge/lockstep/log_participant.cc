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
                          options),
      options_(std::move(options)),
      record_(std::move(record)) {}

LogParticipant::~LogParticipant() = default;

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
  Tell(&LogLockstep::Begin);
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
  morphbus::header_t header;
  // Foreign names on our prefix, and messages that do not decode, are bad.
  message.bad = !name || name->run != options_.run || !DecodeHeader(data, size, &header);
  if (!message.bad && IsHashed(name->topic)) {
    const std::optional<bool> fresh = TellMachine(*name, header, data, size);
    message.bad = !fresh.has_value();
    message.duplicate = !fresh.value_or(true);
    if (fresh) CountHashed(channel, header.sequence, data, size, *fresh);
  } else if (!message.bad && name->topic == Topic::kAsk && name->process == kLogProcess) {
    TakeAsk(data, size);
  }
  // The message is recorded before the machine's actions are carried out, so that nothing is
  // acknowledged that the log does not hold.
  ++(message.bad ? ledger_.bad : ledger_.received);
  if (record_) record_(message);
  CarryOutActions();
}

std::optional<bool> LogParticipant::TellMachine(const ChannelName& name,
                                                const morphbus::header_t& header,
                                                const uint8_t* data, size_t size) {
  const Expectation expect{options_.model_hash, 0};
  // Each kind of message tells the machine something else. A kind that only counts is checked and
  // not decoded, which spares its arrays.
  switch (name.topic) {
    case Topic::kClock: {
      morphbus::sim_clock_t clock;
      if (!Decode(data, size, expect, &clock)) return std::nullopt;
      // The last CLOCK says why the run ended; the first one, how many messages a tick consists of.
      if (clock.phase == morphbus::sim_clock_t::PHASE_END) end_reason_ = clock.end_reason;
      return machine_.OnClock(header.tick, clock.phase, clock.num_modules, clock.num_sensors_parts,
                              clock.num_world_parts, now_us(), &actions_);
    }
    case Topic::kSensors:
      if (!TakeNames(data, size)) return std::nullopt;
      return machine_.OnPart(name.topic, header.sequence, header.tick, now_us(), &actions_);
    case Topic::kWorld:
      if (!Check<morphbus::world_t>(data, size, expect)) return std::nullopt;
      return machine_.OnPart(name.topic, header.sequence, header.tick, now_us(), &actions_);
    default:
      return TakeModule(name, header, data, size);
  }
}

void LogParticipant::CountHashed(std::string_view channel, int64_t sequence, const uint8_t* data,
                                 size_t size, bool fresh) {
  // Gaps and repeats go to the ledger, new payloads into the channel's hash.
  auto tracker = trackers_.find(channel);
  if (tracker == trackers_.end()) tracker = trackers_.emplace(channel, SequenceTracker()).first;
  tracker->second.Take(sequence, &ledger_);
  if (!fresh) return;
  // The first payload of a channel begins its hash.
  auto stream = streams_.find(channel);
  if (stream == streams_.end()) {
    stream = streams_.emplace(std::string(channel), std::make_unique<ReceivedStream>()).first;
  }
  stream->second->Add(sequence, data, size, !options_.realtime);
}

bool LogParticipant::TakeNames(const uint8_t* data, size_t size) {
  // Until all modules are known, SENSORS must be decoded for their names; later a check will do.
  const Expectation expect{options_.model_hash, 0};
  if (machine_.knows_all_names()) {
    return Check<morphbus::sensors_t>(data, size, expect).has_value();
  }
  morphbus::sensors_t sensors;
  if (!Decode(data, size, expect, &sensors)) return false;
  for (const morphbus::module_sensors_t& reading : sensors.modules) {
    if (CheckModuleName(reading.name)) machine_.AddModule(reading.name);
  }
  return true;
}

std::optional<bool> LogParticipant::TakeModule(const ChannelName& name,
                                               const morphbus::header_t& header,
                                               const uint8_t* data, size_t size) {
  const Expectation expect{options_.model_hash, 0};
  // ACTUATOR alone says something that the machine needs to know, so it alone is decoded.
  morphbus::actuator_t actuator;
  actuator.status_count = 0;
  Result<void> sound;
  if (name.topic == Topic::kActuator) {
    sound = Decode(data, size, expect, &actuator);
  } else if (name.topic == Topic::kStatus) {
    sound = Check<morphbus::status_t>(data, size, expect);
  } else {
    sound = Check<morphbus::transform_t>(data, size, expect);
  }
  // A module that SENSORS has not mentioned yet has no number: its message is asked for again. Once
  // all modules' names are known, no other module can be part of the run.
  const int module = machine_.ModuleNumber(std::string(name.process));
  if (!sound || (module < 0 && machine_.knows_all_names())) return std::nullopt;
  return machine_.OnModule(name.topic, module, header.sequence, header.tick, actuator.status_count,
                           now_us(), &actions_);
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
    case Kind::kHello:
      return SayHello(options_.claim, options_.build, 1, "", 0);
    // The sim may go on to 16 ticks beyond this one. With END goes the hash of what was recorded,
    // for the sim to compare with what was published.
    case Kind::kAck:
    case Kind::kEndAck: {
      const bool end = action.kind == Kind::kEndAck;
      ask_t ack = MakeAsk(end ? ask_t::KIND_END_ACK : ask_t::KIND_ACK);
      ack.acknowledged_tick = action.tick;
      if (end) ack.run_hash = run_hash();
      return Ask(kSimProcess, std::move(ack));
    }
    // The machine calls modules by number; the channel is named after the module, or after the sim.
    case Kind::kAskGap: {
      const std::string from =
          action.module < 0 ? std::string(kSimProcess) : machine_.module_names()[action.module];
      return AskForResend(from, action.topic, action.first, action.last);
    }
    // Only now may the sim let everybody go.
    case Kind::kVerdictAck:
      return Ask(kSimProcess, MakeAsk(ask_t::KIND_VERDICT_ACK));
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
