#pragma once
// Both ends of CONTROL and ANSWER: the sim's, which takes commands and answers them, and that of a
// tool, which gives one and waits for the answer.

#include <cstdint>
#include <deque>
#include <functional>
#include <morphbus/control_answer_t.hpp>
#include <morphbus/control_t.hpp>
#include <string>

#include "bridge/control/control_command.h"
#include "bridge/lockstep/outbox.h"
#include "bridge/lockstep/participant.h"
#include "bridge/wire/run_key.h"

namespace morphbus::bridge {

/// A command as the message that carries it; the outbox fills in its header. The command is one
/// that CheckControl passes.
morphbus::control_t MessageOf(const ControlCommand& command, int64_t counter);
/// The command that a message carries, whose fields have passed the wire's checks. Fails if it is
/// none that ParseControl could have read: then no text of CLOCK would stand for it.
Result<ControlCommand> CommandOf(const morphbus::control_t& message);

/// Tells new commands from old ones by their counters, which grow from command to command, also
/// between senders, so that what goes over the bus again is done once. What is old is counted in
/// the sim's ledger.
class CommandFilter {
 public:
  enum class Kind : uint8_t {
    /// A command that is to be obeyed.
    kNew,
    /// A command that was taken before, given once more: its sender has not heard the answer.
    kAgain,
    /// A message that came before, or a command too old to be remembered: no sender waits for an
    /// answer to it.
    kRepeat,
    /// One that a later command came before; its sender may give it anew.
    kOvertaken,
  };

  /// `ledger` outlives the filter.
  explicit CommandFilter(Ledger* ledger) : ledger_(*ledger) {}

  /// Takes a message by its counter and the number that its sender gave it (header.sequence), and
  /// says what it is.
  Kind Take(int64_t counter, int64_t sequence);

 private:
  /// A command that is remembered.
  struct Heard {
    int64_t counter = 0;
    int64_t sequence = 0;  ///< The highest number under which its sender gave it.
    bool taken = false;    ///< It had not been overtaken.
  };

  Ledger& ledger_;
  int64_t last_ = 0;         ///< The highest counter that was taken.
  std::deque<Heard> heard_;  ///< The latest commands, oldest first.
  int64_t forgotten_ = -1;   ///< The highest counter among those before them.
};

/// The sim's end: hands commands on, once each, and answers them. A command that comes again
/// because its sender has not heard the answer is only answered again, and one that a later one
/// overtook is refused.
class ControlService {
 public:
  /// Called with each command that is to be obeyed. Answer() may be called at once or later.
  using Execute = std::function<void(int64_t counter, const ControlCommand& command)>;

  /// `sender`: the run and the model that commands must speak of. `bus` (which lets through only
  /// what has the run's key) and `ledger`, the sim's, where old and malformed commands are counted,
  /// outlive the service.
  ControlService(Bus* bus, const Sender& sender, Ledger* ledger, Execute execute);

  /// Publishes what became of a command.
  void Answer(const ControlAnswer& answer);

 private:
  /// What the bus calls with every message on CONTROL.
  void OnMessage(const uint8_t* data, size_t size);
  /// Publishes the answer to a command that was answered before.
  void Repeat(int64_t counter);
  /// Publishes an answer.
  void Send(const ControlAnswer& answer);

  Ledger& ledger_;
  // Answers go out on their channel, numbered apart from the sim's other messages.
  Outbox outbox_;
  std::string channel_;
  Execute execute_;
  CommandFilter filter_;
  std::deque<ControlAnswer> kept_;  ///< The latest answers, oldest first.
};

/// A tool's end: gives one command and waits for the answer, repeating the command until it comes.
/// Fails if none comes within `patience_us`, or if `stop` (may be null) says so. `bus` is open to
/// all, and `key` the run's; `time` is the machine's monotonic clock.
Result<ControlAnswer> GiveCommand(Bus* bus, const TimeSource& time, const Sender& sender,
                                  const RunKey& key, const ControlCommand& command,
                                  int64_t patience_us, const std::function<bool()>& stop);

}  // namespace morphbus::bridge
