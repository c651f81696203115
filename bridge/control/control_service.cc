#include "bridge/control/control_service.h"

#include <algorithm>
#include <morphbus/control_t.hpp>
#include <optional>
#include <utility>

#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/sealed_bus.h"

namespace morphbus::bridge {
namespace {

/// Answers that are kept for senders that did not hear them.
constexpr size_t kKeptAnswers = 64;
/// Time after which a tool gives its command again.
constexpr int64_t kAskAgainUs = 200'000;
/// What exit statuses 2 and 3 mean to who gave the command (docs/cli.md).
constexpr int kUnusableStatus = 2, kFailedStatus = 3;
/// The answer to a command that a later one has overtaken.
constexpr const char* kOvertakenText = "a later command came first; give it again";

/// The message of a command or an answer; the outbox fills in the rest.
morphbus::control_t MessageOf(int64_t counter, const std::string& text) {
  morphbus::control_t message;
  message.counter = counter;
  message.command = text;
  return message;
}

}  // namespace

ControlService::ControlService(Bus* bus, const TimeSource* time, const Sender& sender,
                               Ledger* ledger, Execute execute)
    : time_(*time),
      ledger_(*ledger),
      filter_(ledger),
      outbox_(bus, sender, ledger),
      channel_(Channel(sender.run, "", Topic::kControl)),
      execute_(std::move(execute)) {
  bus->Subscribe(channel_, [this](std::string_view, const uint8_t* data, size_t size) {
    OnMessage(data, size);
  });
}

void ControlService::Answer(const ControlAnswer& answer) {
  // Kept before it is sent: the sender may ask again at once.
  kept_.push_back(answer);
  if (kept_.size() > kKeptAnswers) kept_.pop_front();
  Send(answer);
}

void ControlService::Send(const ControlAnswer& answer) {
  morphbus::control_t message = MessageOf(time_.NowUs(), AnswerText(answer));
  outbox_.Send(channel_, answer.tick, 0, &message);
}

void ControlService::Repeat(int64_t counter) {
  // Few are kept, so that a search from the front is no burden.
  const auto found = std::ranges::find(kept_, counter, &ControlAnswer::counter);
  // What has not been answered yet will be.
  if (found != kept_.end()) Send(*found);
}

void ControlService::OnMessage(const uint8_t* data, size_t size) {
  // Bytes that are no message at all, or of another model.
  morphbus::control_t message;
  if (!Decode(data, size, {outbox_.sender().model_hash, 0}, &message)) {
    ++ledger_.bad;
    ++ledger_.malformed_commands;
    return;
  }
  ++ledger_.received;
  switch (filter_.Take(message)) {
    case CommandFilter::Kind::kAnswer:
    case CommandFilter::Kind::kRepeat:
      return;
    case CommandFilter::Kind::kAgain:
      return Repeat(message.counter);
    case CommandFilter::Kind::kOvertaken:
      // It is not kept: who needs it asks again.
      return Send(
          {message.counter, ControlAnswer::State::kRefused, 0, kFailedStatus, kOvertakenText});
    case CommandFilter::Kind::kNew:
      break;
  }
  // What it says is its sender's own doing, and so is a mistake in it.
  const Result<ControlCommand> command = ParseControl(message.command);
  if (command) return execute_(message.counter, *command);
  ++ledger_.malformed_commands;
  Answer({message.counter, ControlAnswer::State::kRefused, 0, kUnusableStatus,
          command.error().message});
}

Result<ControlAnswer> GiveCommand(Bus* bus, const TimeSource& time, const Sender& sender,
                                  const RunKey& key, const std::string& command,
                                  int64_t patience_us, const std::function<bool()>& stop) {
  // The tool is no process of the run, so that its ledger serves nobody.
  Ledger ledger;
  SealedBus sealed(bus, key);
  Outbox outbox(&sealed, sender, &ledger);
  const std::string channel = Channel(sender.run, "", Topic::kControl);
  morphbus::control_t message = MessageOf(time.NowUs(), command);
  // Of the answers that to this very command is meant.
  std::optional<ControlAnswer> answer;
  sealed.Subscribe(channel, [&](std::string_view, const uint8_t* data, size_t size) {
    morphbus::control_t heard;
    if (!Decode(data, size, {sender.model_hash, 0}, &heard) || !IsAnswer(heard.command)) return;
    const Result<ControlAnswer> parsed = ParseAnswer(heard.command);
    if (!parsed || parsed->counter != message.counter) return;
    // Two tools at once: the one that came second says it anew.
    if (parsed->reason == kOvertakenText) {
      message = MessageOf(time.NowUs(), command);
    } else {
      answer = *parsed;
    }
  });
  const int64_t begin_us = time.NowUs();
  int64_t next_us = begin_us;
  // Repeated until it is answered: the bus may lose a datagram either way.
  while (!answer && time.NowUs() < begin_us + patience_us && !(stop && stop())) {
    if (time.NowUs() >= next_us) {
      outbox.Send(channel, 0, 0, &message);
      next_us = time.NowUs() + kAskAgainUs;
    }
    sealed.Handle(20);
  }
  sealed.Unsubscribe(channel);
  if (!answer) return Fail("run " + sender.run + " does not answer");
  return *answer;
}

}  // namespace morphbus::bridge
