#include "bridge/control/control_service.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/sealed_bus.h"

namespace morphbus::bridge {
namespace {

using State = ControlAnswer::State;

/// Commands that are remembered, to tell one that comes again from one that was overtaken.
constexpr size_t kRemembered = 1024;
/// Answers that are kept for senders that did not hear them.
constexpr size_t kKeptAnswers = 64;
/// Time after which a tool gives its command again.
constexpr int64_t kAskAgainUs = 200'000;
/// What exit status 2 means to who gave the command (docs/cli.md).
constexpr int kUnusableStatus = 2;

/// An answer as the message that carries it, its texts cut to what that holds.
morphbus::control_answer_t MessageOf(const ControlAnswer& answer) {
  morphbus::control_answer_t message;
  message.counter = answer.counter;
  message.state = static_cast<int8_t>(answer.state);
  message.tick = answer.tick;
  message.status = static_cast<int8_t>(answer.status);
  message.reason = CutText(answer.reason, kLongestText);
  message.command = CutText(answer.command, kLongestText);
  message.has_time = answer.at.has_value() ? 1 : 0;
  message.time_s = answer.at.value_or(0);
  return message;
}

ControlAnswer AnswerOf(const morphbus::control_answer_t& message) {
  ControlAnswer answer;
  answer.counter = message.counter;
  answer.state = static_cast<State>(message.state);
  answer.tick = message.tick;
  answer.status = message.status;
  answer.reason = message.reason;
  answer.command = message.command;
  if (message.has_time != 0) answer.at = message.time_s;
  return answer;
}

}  // namespace

morphbus::control_t MessageOf(const ControlCommand& command, int64_t counter) {
  morphbus::control_t message;
  message.counter = counter;
  message.kind = static_cast<int8_t>(command.kind);
  // What is acted on.
  message.module_name = command.part.module;
  message.part_name = command.part.part;
  message.mate_module_name = command.mate.module;
  message.mate_part_name = command.mate.part;
  // How.
  message.num_steps = static_cast<int32_t>(command.steps);
  message.speed = command.speed;
  std::ranges::copy(command.direction_W, message.direction);
  message.force_n = command.newtons;
  message.duration_s = command.seconds;
  message.cold = command.cold ? 1 : 0;
  // With which program, or command of it.
  message.program_path = command.program;
  message.program_hash = static_cast<int64_t>(command.program_hash);
  message.role_name = command.role;
  message.routine_name = command.routine;
  message.arguments = command.arguments;
  if (command.kind == ControlKind::kSet) {
    message.routine_name = command.parameter;
    message.arguments = {command.value};
  }
  message.num_arguments = static_cast<int8_t>(message.arguments.size());
  message.to_module_name = command.to;
  message.has_time = command.at.has_value() ? 1 : 0;
  message.time_s = command.at.value_or(0);
  return message;
}

Result<ControlCommand> CommandOf(const morphbus::control_t& message) {
  ControlCommand command;
  command.kind = static_cast<ControlKind>(message.kind);
  // Whatever else the sender left in the message means nothing.
  switch (command.kind) {
    case ControlKind::kPause:
    case ControlKind::kResume:
    case ControlKind::kStop:
      break;
    case ControlKind::kStep:
      command.steps = message.num_steps;
      break;
    case ControlKind::kSpeed:
      command.speed = message.speed;
      break;
    case ControlKind::kPush:
      command.part = {message.module_name, message.part_name};
      std::ranges::copy(message.direction, command.direction_W.begin());
      command.newtons = message.force_n;
      command.seconds = message.duration_s;
      break;
    case ControlKind::kRestart:
      command.cold = message.cold != 0;
      [[fallthrough]];
    case ControlKind::kKill:
    case ControlKind::kLose:
    case ControlKind::kInspect:
      command.part.module = message.module_name;
      break;
    case ControlKind::kConnect:
      command.mate = {message.mate_module_name, message.mate_part_name};
      [[fallthrough]];
    case ControlKind::kDisconnect:
      command.part = {message.module_name, message.part_name};
      break;
    case ControlKind::kDeploy:
      command.program = message.program_path;
      command.program_hash = static_cast<uint64_t>(message.program_hash);
      command.to = message.to_module_name;
      if (message.has_time != 0) command.at = message.time_s;
      break;
    case ControlKind::kInvoke:
      command.role = message.role_name;
      command.routine = message.routine_name;
      command.arguments = message.arguments;
      command.to = message.to_module_name;
      break;
    case ControlKind::kSet:
      command.parameter = message.routine_name;
      if (!message.arguments.empty()) command.value = message.arguments[0];
      if (message.has_time != 0) command.at = message.time_s;
      break;
  }
  if (Result<void> sound = CheckControl(command); !sound) return tl::unexpected(sound.error());
  return command;
}

CommandFilter::Kind CommandFilter::Take(int64_t counter, int64_t sequence) {
  const bool is_new = counter > last_;
  if (!is_new) ++ledger_.old_commands;
  // A command that is given once more has another number; under the same number the network doubled
  // it, or a listener said it again.
  const auto known = std::ranges::find(heard_, counter, &Heard::counter);
  if (known != heard_.end()) {
    if (sequence <= known->sequence) return Kind::kRepeat;
    known->sequence = sequence;
    return known->taken ? Kind::kAgain : Kind::kOvertaken;
  }
  // Too old to be remembered, it may have been obeyed long ago, and must not be obeyed again.
  if (counter <= forgotten_) return Kind::kRepeat;
  heard_.push_back({counter, sequence, is_new});
  if (heard_.size() > kRemembered) {
    forgotten_ = std::max(forgotten_, heard_.front().counter);
    heard_.pop_front();
  }
  // From here on this one, and everything before it, is known.
  if (is_new) last_ = counter;
  return is_new ? Kind::kNew : Kind::kOvertaken;
}

ControlService::ControlService(Bus* bus, const Sender& sender, Ledger* ledger, Execute execute)
    : ledger_(*ledger),
      outbox_(bus, sender, ledger),
      channel_(Channel(sender.run, "", Topic::kAnswer)),
      execute_(std::move(execute)),
      filter_(ledger) {
  bus->Subscribe(
      Channel(sender.run, "", Topic::kControl),
      [this](std::string_view, const uint8_t* data, size_t size) { OnMessage(data, size); });
}

void ControlService::Answer(const ControlAnswer& answer) {
  // Kept before it is sent: the sender may ask again at once.
  kept_.push_back(answer);
  if (kept_.size() > kKeptAnswers) kept_.pop_front();
  Send(answer);
}

void ControlService::Send(const ControlAnswer& answer) {
  morphbus::control_answer_t message = MessageOf(answer);
  outbox_.Send(channel_, answer.tick, 0, &message);
}

void ControlService::OnMessage(const uint8_t* data, size_t size) {
  // Bytes that are no message at all, or of another model.
  morphbus::control_t message;
  if (!Decode(data, size, {outbox_.sender().model_hash, 0}, &message)) {
    ++ledger_.bad;
    ++ledger_.malformed_commands;
    return;
  }
  // Whether it is new comes before what it says: no command is obeyed twice.
  ++ledger_.received;
  switch (filter_.Take(message.counter, message.header.sequence)) {
    case CommandFilter::Kind::kRepeat:
      return;
    case CommandFilter::Kind::kAgain:
      return Repeat(message.counter);
    case CommandFilter::Kind::kOvertaken: {
      // It is not kept: a sender that needs it gives it anew.
      ControlAnswer overtaken;
      overtaken.counter = message.counter;
      overtaken.state = State::kOvertaken;
      return Send(overtaken);
    }
    case CommandFilter::Kind::kNew:
      break;
  }
  // What it says is its sender's own doing, and so is a mistake in it.
  const Result<ControlCommand> command = CommandOf(message);
  if (command) return execute_(message.counter, *command);
  ++ledger_.malformed_commands;
  ControlAnswer refused;
  refused.counter = message.counter;
  refused.status = kUnusableStatus;
  refused.reason = command.error().message;
  Answer(refused);
}

void ControlService::Repeat(int64_t counter) {
  // Few are kept, so that a search from the front is no burden. What has not been answered yet will
  // be.
  const auto found = std::ranges::find(kept_, counter, &ControlAnswer::counter);
  if (found != kept_.end()) Send(*found);
}

Result<ControlAnswer> GiveCommand(Bus* bus, const TimeSource& time, const Sender& sender,
                                  const RunKey& key, const ControlCommand& command,
                                  int64_t patience_us, const std::function<bool()>& stop) {
  // The tool is no process of the run, so that its ledger is never read.
  Ledger ledger;
  SealedBus sealed(bus, key);
  Outbox outbox(&sealed, sender, &ledger);
  morphbus::control_t message = MessageOf(command, time.NowUs());
  // Of the answers that to this very command is meant.
  std::optional<ControlAnswer> answer;
  const std::string answers = Channel(sender.run, "", Topic::kAnswer);
  sealed.Subscribe(answers, [&](std::string_view, const uint8_t* data, size_t size) {
    morphbus::control_answer_t heard;
    if (!Decode(data, size, {sender.model_hash, 0}, &heard)) return;
    if (heard.counter != message.counter) return;
    // Two tools at once: the one that came second says it anew.
    if (heard.state == morphbus::control_answer_t::STATE_OVERTAKEN) {
      message.counter = time.NowUs();
    } else {
      answer = AnswerOf(heard);
    }
  });
  const int64_t begin_us = time.NowUs();
  int64_t next_us = begin_us;
  // Repeated until it is answered: the bus may lose a datagram either way.
  const std::string channel = Channel(sender.run, "", Topic::kControl);
  while (!answer && time.NowUs() < begin_us + patience_us && !(stop && stop())) {
    if (time.NowUs() >= next_us) {
      outbox.Send(channel, 0, 0, &message);
      next_us = time.NowUs() + kAskAgainUs;
    }
    sealed.Handle(20);
  }
  sealed.Unsubscribe(answers);
  if (!answer) return Fail("run " + sender.run + " does not answer");
  return *answer;
}

}  // namespace morphbus::bridge
