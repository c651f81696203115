#pragma once
// A child process that cannot outlive us.

#include <sys/types.h>

#include <string>
#include <vector>

#include "compiler/source/result.h"

namespace morphbus::tools {

class ChildProcess {
 public:
  struct Options {
    std::string name;               ///< For messages: "sim", "module m3".
    std::vector<std::string> argv;  ///< argv[0] is the path of the program.
    int death_signal = 9;           ///< Sent by the kernel when we die, however we die.
    int inherited_fd = -1;          ///< Stays open in the child under the same number; -1: none.
    bool quiet = false;             ///< Its stdout and stderr go to nowhere.
  };

  /// Starts the program in a process group of its own, so that Ctrl-C reaches only us.
  static Result<ChildProcess> Start(const Options& options);

  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  /// Kills it if it still runs, and waits for it.
  ~ChildProcess();

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] pid_t pid() const { return pid_; }
  /// Becomes readable when the process ends; for poll().
  [[nodiscard]] int pidfd() const { return pidfd_; }

  /// True if it has ended; then `exit_text()` says how.
  bool Poll();
  [[nodiscard]] bool ended() const { return ended_; }
  /// "exited with status 3", "was killed by signal 9 (Killed)".
  [[nodiscard]] const std::string& exit_text() const { return exit_text_; }
  /// Exit status, or 128 + signal, once ended.
  [[nodiscard]] int status() const { return status_; }

  void Signal(int signal) const;

 private:
  ChildProcess(std::string name, pid_t pid, int pidfd)
      : name_(std::move(name)), pid_(pid), pidfd_(pidfd) {}

  std::string name_;
  pid_t pid_ = -1;
  int pidfd_ = -1;
  bool ended_ = false;
  int status_ = 0;
  std::string exit_text_;
};

/// Directory of the running executable, where the others lie too.
std::string ExecutableFolder();

}  // namespace morphbus::tools
