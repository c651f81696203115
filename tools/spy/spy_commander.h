#pragma once
// Commands that the spy's keys give to the run, without keeping the screen waiting.

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "tools/launch/run_choice.h"

namespace morphbus::tools {

/// What became of a command.
struct CommandOutcome {
  std::string text;     ///< For people, one line.
  bool failed = false;  ///< It was refused, or nobody answered.
};

/// Gives one command at a time, on a bus and a thread of its own, for a run answers when it likes.
class SpyCommander {
 public:
  /// `choice` says which run; `url` is the bus on which it is, whose network was joined already.
  SpyCommander(RunChoice choice, std::string url);
  /// Gives up a command that is under way, which the run may carry out all the same.
  ~SpyCommander();
  SpyCommander(const SpyCommander&) = delete;
  SpyCommander& operator=(const SpyCommander&) = delete;

  /// Gives the command (as for `morphbus control`); false if the last one is still under way.
  bool Give(const std::string& command);
  /// What became of the last command, once; nothing while it is under way or when it was told.
  std::optional<CommandOutcome> Outcome();

 private:
  /// What the thread does: finds the run's key, gives the command, waits for the answer.
  CommandOutcome Run(const std::string& command) const;

  RunChoice choice_;
  std::string url_;
  std::thread thread_;
  std::atomic<bool> done_ = false;  ///< `outcome_` is there to be read.
  std::atomic<bool> stop_ = false;  ///< The thread should end at once.
  CommandOutcome outcome_;          ///< The thread's until `done_`.
};

}  // namespace morphbus::tools
