#pragma once
// Commands to a run of this machine: the one way in for `control`, the keys of the spy and the
// clients of the monitor.

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "bridge/bus/bus.h"
#include "bridge/control/control_command.h"
#include "tools/base/json.h"
#include "tools/control/controlled_run.h"

namespace morphbus::tools {

/// Gives a command and waits for the answer. Fails if none comes, or if `stop` says so. `bus` is
/// the run's, and open to all.
Result<bridge::ControlAnswer> GiveTo(const ControlledRun& run, bridge::Bus* bus,
                                     const bridge::ControlCommand& command,
                                     const std::function<bool()>& stop);

/// An answer as `control --json` prints it: "run", "command" (as CLOCK names it), "tick",
/// "seconds", "pending", "refused"; "switch_seconds" for a deployment, when all modules go over.
Json AnswerJson(const ControlledRun& run, const bridge::ControlAnswer& answer);

/// One command that waits for its turn.
struct WaitingCommand {
  bridge::ControlCommand command;
  /// Completes the command, as by its program; may be null. Called in the commander's thread, as is
  /// `done`, with AnswerJson(), or with why it was refused.
  std::function<Result<void>(const ControlledRun& run, bridge::ControlCommand* command)> complete;
  std::function<void(const Json& answer, const std::string& refusal)> done;
};

/// Gives commands one after the other in a thread of its own: a run may take seconds to answer.
class Commander {
 public:
  /// A run, and a bus to it that nobody else uses.
  struct Way {
    ControlledRun run;
    std::unique_ptr<bridge::Bus> bus;
  };
  /// Finds the run to command, for each command anew; called in the commander's thread.
  using Find = std::function<Result<std::shared_ptr<Way>>()>;

  explicit Commander(Find find);
  /// Gives up a command that is under way, which the run may carry out all the same, and drops
  /// those that wait.
  ~Commander();
  Commander(const Commander&) = delete;
  Commander& operator=(const Commander&) = delete;

  /// Puts a command behind those that wait; returns at once. Its `done` is called once, unless the
  /// commander ends before it is its turn.
  void Give(WaitingCommand command);

 private:
  /// What the thread does: one command after the other, until it is to end.
  void Work();
  /// Carries one out. Fails with the reason of a refusal.
  Result<Json> Do(WaitingCommand given);

  Find find_;         ///< The thread's alone.
  std::mutex mutex_;  ///< Guards the three below.
  std::condition_variable given_;
  std::deque<WaitingCommand> waiting_;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace morphbus::tools
