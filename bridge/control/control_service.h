#pragma once
// Both ends of CONTROL: the sim's, which takes commands and answers them, and that of a tool, which
// gives one and waits for the answer.

#include <deque>
#include <functional>
#include <string>

#include "bridge/control/command_filter.h"
#include "bridge/control/control_command.h"
#include "bridge/lockstep/outbox.h"
#include "bridge/lockstep/participant.h"
#include "bridge/wire/run_key.h"

namespace morphbus::bridge {

/// The sim's end: hands commands on, once each, and answers them. A command that comes again
/// because its sender has not heard the answer is answered again; so is one that a later one
/// overtook.
class ControlService {
 public:
  /// Called with each command that is to be obeyed. Answer() may be called at once or later.
  using Execute = std::function<void(int64_t counter, const ControlCommand& command)>;

  /// `sender`: the run and the model that commands must speak of. `bus` (which lets through only
  /// what has the run's key), `time` (the machine's monotonic clock) and `ledger`, the sim's,
  /// outlive the service.
  ControlService(Bus* bus, const TimeSource* time, const Sender& sender, Ledger* ledger,
                 Execute execute);

  /// Publishes what became of a command.
  void Answer(const ControlAnswer& answer);

 private:
  /// What the bus calls with every message on CONTROL, our own answers among them.
  void OnMessage(const uint8_t* data, size_t size);
  /// Publishes an answer.
  void Send(const ControlAnswer& answer);
  /// Publishes the answer to a command that was answered before.
  void Repeat(int64_t counter);

  // By which clock, which commands are new, and what is counted of the others.
  const TimeSource& time_;
  Ledger& ledger_;
  CommandFilter filter_;
  // Answers go out on their channel, numbered apart from the sim's other messages.
  Outbox outbox_;
  std::string channel_;
  Execute execute_;
  std::deque<ControlAnswer> kept_;  ///< The latest answers, oldest first.
};

/// A tool's end: gives one command and waits for the answer, repeating the command until it comes.
/// Fails if none comes within `patience_us`, or if `stop` (may be null) says so. `bus` is open to
/// all, and `key` the run's; `time` is the machine's monotonic clock.
Result<ControlAnswer> GiveCommand(Bus* bus, const TimeSource& time, const Sender& sender,
                                  const RunKey& key, const std::string& command,
                                  int64_t patience_us, const std::function<bool()>& stop);

}  // namespace morphbus::bridge
