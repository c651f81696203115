#pragma once
// Commands to a run at a viewer's wish, the signed way of `morphbus control`, in a thread of its
// own: a run may take seconds to answer.

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "bridge/bus/bus.h"
#include "tools/base/json.h"
#include "tools/launch/controlled_run.h"
#include "tools/monitor/program_text.h"

namespace morphbus::tools {

/// One command that was given.
struct MonitorCommand {
  std::string text;  ///< In the words of `morphbus control`; "deploy NAME …" with a program below.
  /// A program to compile and deploy: its text. The command's own is its name.
  std::string program;
  /// Called in the commander's thread with what `control --json` prints, or why it was refused.
  std::function<void(const Json& answer, const std::string& refusal)> done;
};

/// Gives commands one after the other.
class RunCommander {
 public:
  /// `bus` is one that nobody else uses; `texts` outlives the commander.
  RunCommander(ControlledRun run, std::unique_ptr<bridge::Bus> bus, ProgramTexts* texts);
  /// Gives up a command that is under way, which the run may carry out all the same, and drops
  /// those that wait.
  ~RunCommander();
  RunCommander(const RunCommander&) = delete;
  RunCommander& operator=(const RunCommander&) = delete;

  /// Puts a command behind those that wait; returns at once. Its `done` is called once, in the
  /// commander's thread, unless the commander ends before it is its turn.
  void Give(MonitorCommand command);

 private:
  /// What the thread does: one command after the other, until it is to end.
  void Work();
  /// Carries one out. Fails with the reason of a refusal.
  Result<Json> Do(const MonitorCommand& given);

  // The thread's alone.
  ControlledRun run_;
  std::unique_ptr<bridge::Bus> bus_;
  ProgramTexts& texts_;
  std::mutex mutex_;  ///< Guards the two below.
  std::condition_variable given_;
  std::deque<MonitorCommand> waiting_;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace morphbus::tools
