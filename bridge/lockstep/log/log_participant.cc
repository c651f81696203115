#include "bridge/lockstep/log/log_participant.h"

#include <algorithm>
#include <morphbus/actuator_t.hpp>
#include <morphbus/admit_t.hpp>
#include <morphbus/control_answer_t.hpp>
#include <morphbus/control_t.hpp>
#include <morphbus/health_t.hpp>
#include <morphbus/hello_t.hpp>
#include <morphbus/info_part_t.hpp>
#include <morphbus/leave_t.hpp>
#include <morphbus/progress_t.hpp>
#include <morphbus/resend_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/totals_t.hpp>
#include <morphbus/transform_t.hpp>
#include <morphbus/verdict_t.hpp>
#include <morphbus/world_t.hpp>
#include <utility>

#include "bridge/wire/sealed_bus.h"
#include "bridge/wire/wire_peek.h"

namespace morphbus::bridge {
namespace {

using Taken = LogLockstep::Taken;

/// The description is published at requests at most once in this time, microseconds.
constexpr int64_t kInfoPauseUs = 100'000;

/// Messages outside the hash that are let in before SENSORS has named all modules: a HEALTH of each
/// module of the largest robot.
constexpr int64_t kMostEarly = 32768;

/// Checks a message as one of its topic's type.
using Checker = Result<void> (*)(const uint8_t* data, size_t size, const Expectation& expect);

/// Those of the messages that a log holds, but for CLOCK, which is always decoded.
constexpr std::pair<Topic, Checker> kCheckers[] = {
    {Topic::kTransform, &Check<morphbus::transform_t>},
    {Topic::kActuator, &Check<morphbus::actuator_t>},
    {Topic::kStatus, &Check<morphbus::status_t>},
    {Topic::kSensors, &Check<morphbus::sensors_t>},
    {Topic::kWorld, &Check<morphbus::world_t>},
    {Topic::kHealth, &Check<morphbus::health_t>},
    {Topic::kResend, &Check<morphbus::resend_t>},
    {Topic::kAdmit, &Check<morphbus::admit_t>},
    {Topic::kLeave, &Check<morphbus::leave_t>},
    {Topic::kVerdict, &Check<morphbus::verdict_t>},
    {Topic::kProgress, &Check<morphbus::progress_t>},
    {Topic::kTotals, &Check<morphbus::totals_t>},
    {Topic::kHello, &Check<morphbus::hello_t>},
    {Topic::kControl, &Check<morphbus::control_t>},
    {Topic::kAnswer, &Check<morphbus::control_answer_t>},
    {Topic::kInfo, &Check<morphbus::info_part_t>}};

/// Whether a message of the topic is all that it must be; what a log does not hold may be anything.
bool IsSound(Topic topic, const LoggedMessage& message, const Expectation& expect) {
  const auto* const found = std::ranges::find(kCheckers, topic, &std::pair<Topic, Checker>::first);
  return found == std::end(kCheckers) ||
         found->second(message.data, message.size, expect).has_value();
}

}  // namespace

LogParticipant::LogParticipant(Bus* bus, const TimeSource* time, LogParticipantOptions options,
                               Sink record)
    : LockstepParticipant(bus, time, {options.run, std::string(kLogProcess), options.model_hash, 0},
                          options),
      options_(std::move(options)),
      record_(std::move(record)) {}

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

void LogParticipant::OnTime() {
  LockstepParticipant::OnTime();
  AnswerInfo();
}

void LogParticipant::OnMessage(std::string_view channel, const uint8_t* data, size_t size) {
  // Everything on the run's channels goes to the recorder, with a note of what it is worth.
  LoggedMessage message{channel, data, size};
  // A channel that has begun is one of the run's, and was taken apart then.
  ReceivedStream* const stream = streams_.Find(channel);
  const std::optional<ChannelName> name = stream != nullptr ? stream->name : ParseChannel(channel);
  morphbus::header_t header;
  const bool ours = stream != nullptr || (name && name->run == options_.run && HasChannel(*name));
  // A channel that the run does not have costs a count, whatever it carries.
  if (!ours || !DecodeHeader(data, size, &header)) {
    message.bad = true;
  } else if (IsHashed(name->topic)) {
    TakeHashed(*name, stream, header, &message);
  } else {
    TakeOther(*name, &message);
  }
  // The message is recorded before the machine's actions are carried out, so that nothing is
  // acknowledged that the log does not hold.
  ++(message.bad ? ledger_.bad : ledger_.received);
  if (record_) record_(message);
  CarryOutActions();
}

bool LogParticipant::HasProcess(std::string_view process) const {
  return process == kSimProcess || process == kLogProcess || machine_.ModuleNumber(process) >= 0;
}

bool LogParticipant::HasChannel(const ChannelName& name) {
  // Channels without a process, such as CONTROL, are the run's from the beginning.
  if (name.process.empty() || HasProcess(name.process)) return true;
  return !machine_.knows_all_names() && (IsHashed(name.topic) || ++early_ <= kMostEarly);
}

void LogParticipant::TakeHashed(const ChannelName& name, ReceivedStream* stream,
                                const morphbus::header_t& header, LoggedMessage* message) {
  const MaybeTaken taken = TellMachine(name, stream, header, message);
  message->bad = !taken.has_value();
  if (message->bad) return;
  message->refused = *taken == Taken::kOutside || *taken == Taken::kMisnumbered;
  if (message->refused) {
    const std::string tick = "tick " + std::to_string(header.tick);
    return CountRefused(
        &Ledger::outside_window, message->channel,
        *taken == Taken::kOutside
            ? tick + " after tick " + std::to_string(machine_.complete_tick())
            : "number " + std::to_string(header.sequence) + " does not belong to " + tick);
  }
  message->duplicate = *taken == Taken::kKnown;
  // A stream begins with a new payload: modules that nobody has named yet have none.
  if (stream == nullptr && !message->duplicate) stream = &BeginStream(*message, name);
  if (stream == nullptr) return;
  message->channel_index = stream->index;
  // Gaps, repeats and contradictions go to the ledger, new payloads into the channel's hash.
  const uint64_t digest = MessageDigest(message->data, message->size);
  Track(&stream->tracker, message->channel, header.sequence, digest);
  if (!message->duplicate) stream->Add(header.sequence, digest, !options_.realtime);
}

ReceivedStream& LogParticipant::BeginStream(const LoggedMessage& message, const ChannelName& name) {
  // Of its numbers a window of ticks is remembered; in each the simulator's may have many parts.
  const int parts = name.process == kSimProcess ? machine_.most_parts() : 1;
  return streams_.Begin(message.channel, machine_.ModuleNumber(name.process),
                        2 * options_.window * parts);
}

void LogParticipant::CompareTotals(const ChannelName& name, const uint8_t* data, size_t size) {
  // Before the run and after it there is nothing to compare.
  morphbus::health_t health;
  if (machine_.done() || !Decode(data, size, {}, &health)) return;
  const std::string process(name.process);
  const std::string topic = streams_.FirstDifference(options_.run + "/" + process + "/",
                                                     health.totals, options_.realtime);
  if (topic.empty()) return;
  // The log would hold another run than the one that happened: there is no use in going on.
  error_ =
      "LOG recorded other messages on " + process + "/" + topic + " than " + process + " published";
  machine_.GiveUp();
}

void LogParticipant::TakeOther(const ChannelName& name, LoggedMessage* message) {
  message->bad = !IsSound(name.topic, *message, {});
  if (message->bad) return;
  // What was said once is recorded once, and acted on once.
  message->duplicate = IsRepeat(name, message->data, message->size);
  if (message->duplicate) return;
  // What speaks of another model is recorded, but changes nothing.
  const auto is_ours = [&](auto* out) {
    return Decode(message->data, message->size, {options_.model_hash, 0}, out).has_value();
  };
  switch (name.topic) {
    case Topic::kHealth:
      return CompareTotals(name, message->data, message->size);
    case Topic::kResend:
      if (name.process == kLogProcess) TakeResend(message->data, message->size);
      return;
    case Topic::kVerdict:
      if (morphbus::verdict_t verdict; is_ours(&verdict)) {
        machine_.OnVerdict(now_us(), &actions_);
        if (machine_.verdict_heard()) error_ = verdict.error;
      }
      return;
    case Topic::kLeave:
      if (morphbus::leave_t leave; is_ours(&leave) && leave.process.empty()) {
        machine_.OnLeaveAll(&actions_);
      }
      return;
    case Topic::kProgress:
      if (morphbus::progress_t progress; name.process == kSimProcess && is_ours(&progress)) {
        machine_.OnProgress(progress.header.tick, now_us(), &actions_);
      }
      return;
    default:
      return;
  }
}

LogParticipant::MaybeTaken LogParticipant::TellClock(const morphbus::header_t& header,
                                                     LoggedMessage* message) {
  morphbus::sim_clock_t clock;
  if (!Decode(message->data, message->size, {options_.model_hash, 0}, &clock)) return std::nullopt;
  // The last CLOCK says why the run ended; the first one, how many messages a tick consists of.
  const Taken taken =
      machine_.OnClock(header.sequence, header.tick, clock.phase, clock.num_modules,
                       clock.num_sensors_parts, clock.num_world_parts, now_us(), &actions_);
  if (taken != Taken::kFresh) return taken;
  message->end = clock.phase == morphbus::sim_clock_t::PHASE_END;
  if (message->end) end_reason_ = clock.end_reason;
  // Of a module that is lost in its tick nothing more is to be expected.
  for (const std::string& control : clock.controls) {
    const std::string_view lost = LostModule(control);
    if (!lost.empty()) machine_.Lose(std::string(lost), header.tick, now_us(), &actions_);
  }
  return taken;
}

LogParticipant::MaybeTaken LogParticipant::TellMachine(const ChannelName& name,
                                                       const ReceivedStream* stream,
                                                       const morphbus::header_t& header,
                                                       LoggedMessage* message) {
  if (name.topic == Topic::kClock) return TellClock(header, message);
  // A kind that only counts is checked and not decoded, which spares its arrays; SENSORS is decoded
  // for the modules' names until all are known.
  const bool names = name.topic == Topic::kSensors && !machine_.knows_all_names();
  const bool sound = names ? TakeNames(message->data, message->size)
                           : IsSound(name.topic, *message, {options_.model_hash, 0});
  if (!sound) return std::nullopt;
  if (name.process == kSimProcess) {
    return machine_.OnPart(name.topic, header.sequence, header.tick, now_us(), &actions_);
  }
  // A module that SENSORS has not mentioned yet has no number: its message is asked for again. Once
  // all modules' names are known, no other module can be part of the run.
  const int module = stream != nullptr ? stream->module : machine_.ModuleNumber(name.process);
  if (module < 0 && machine_.knows_all_names()) return std::nullopt;
  // ACTUATOR alone says something that the machine needs to know.
  const int64_t status_count = name.topic == Topic::kActuator ? PeekStatusCount(message->data) : 0;
  return machine_.OnModule(name.topic, module, header.sequence, header.tick, status_count, now_us(),
                           &actions_);
}

bool LogParticipant::TakeNames(const uint8_t* data, size_t size) {
  morphbus::sensors_t sensors;
  if (!Decode(data, size, {options_.model_hash, 0}, &sensors)) return false;
  for (const morphbus::module_sensors_t& reading : sensors.modules) {
    if (CheckModuleName(reading.name)) machine_.AddModule(reading.name);
  }
  return true;
}

void LogParticipant::TakeResend(const uint8_t* data, size_t size) {
  morphbus::resend_t ask;
  if (!Decode(data, size, {}, &ask)) return;
  const std::optional<ChannelName> wanted = ParseChannel(ask.channel);
  if (wanted && wanted->topic == Topic::kInfo) {
    info_wanted_ = true;
    AnswerInfo();
  } else if (wanted && wanted->topic == Topic::kProgress) {
    // The sim asks how far the logger is when it has not heard of that for long.
    machine_.OnPoll(ask.header.tick, now_us(), &actions_);
  }
}

void LogParticipant::AnswerInfo() {
  // Several may ask at once, and one answer is for all of them.
  if (!info_wanted_ || !publish_info_ || now_us() < info_due_us_) return;
  info_wanted_ = false;
  info_due_us_ = now_us() + kInfoPauseUs;
  publish_info_();
}

void LogParticipant::SayProgress() {
  Say(kLogProcess, Topic::kProgress,
      morphbus::progress_t{{}, machine_.complete_tick(), machine_.verdict_heard()});
}

void LogParticipant::CarryOut(const LogAction& action) {
  switch (action.kind) {
    // The logger has no images and never resumes, so it names no type and no incarnation but the
    // first.
    case LogAction::Kind::kHello:
      return SayHello(options_.claim, options_.build, 1, "", 0);
    // The sim may go on beyond this one by as many ticks as it keeps (options.window).
    case LogAction::Kind::kAck:
      return SayProgress();
    // With END goes what was recorded, for the sim to compare with what was published.
    case LogAction::Kind::kEndAck:
      return SayTotals(action.tick, totals());
    // The machine calls modules by number; the channel is named after the module, or after the sim.
    case LogAction::Kind::kAskGap: {
      const std::string from =
          action.module < 0 ? std::string(kSimProcess) : machine_.module_names()[action.module];
      return AskForResend(from, action.topic, action.first, action.last);
    }
    // Only now may the sim let everybody go.
    case LogAction::Kind::kVerdictAck:
      return SayProgress();
    // A run that ended well has told us so; anything else has a reason, which error() gives.
    case LogAction::Kind::kFinish:
      if (!error_.empty()) return;
      if (!complete()) {
        error_ = "the run ended before the logger had all of it";
      } else if (!machine_.verdict_heard()) {
        error_ = "the simulator left without saying how the run ended";
      }
      return;
    // Whatever was recorded so far stays, but the log is not whole.
    case LogAction::Kind::kLostSim:
      error_ = "nothing heard from run '" + options_.run + "' any more" +
               UnauthenticText(bus_->unauthentic());
      return;
  }
}

}  // namespace morphbus::bridge
