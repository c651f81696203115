#pragma once
// A child process that cannot outlive us.

#include <sys/types.h>

#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "tools/base/descriptor.h"

namespace morphbus::tools {

/// A program that this process started and watches. The object owns the child: it can be moved, not
/// copied, and its destructor kills a child that still runs. Where this process dies without
/// running destructors, the kernel sends the child its death signal (PR_SET_PDEATHSIG).
class ChildProcess {
 public:
  /// How to start a child.
  struct Options {
    std::string name;               ///< For messages: "sim", "module m3".
    std::vector<std::string> argv;  ///< argv[0] is the path of the program.
    /// The kernel sends this signal to the child when this process dies, however it dies. 9 is
    /// SIGKILL; a child that has a file to close gets SIGTERM.
    int death_signal = 9;
    /// Stay open in the child under the same numbers.
    std::vector<int> inherited_fds = {};
    bool quiet = false;  ///< Its stdout and stderr go to nowhere.
    /// What becomes its stdin, stdout and stderr; -1: ours. The caller closes its own copies.
    int input = -1, output = -1, errors = -1;
  };

  /// Starts the program in a process group of its own, so that Ctrl-C reaches only us.
  /// Fails, with the reason of fork or exec, if the program does not start.
  static Result<ChildProcess> Start(const Options& options);

  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  /// Kills it if it still runs, and waits for it.
  ~ChildProcess();

  /// Options::name.
  [[nodiscard]] const std::string& name() const { return name_; }
  /// The process id; somebody else may have it once the child has ended.
  [[nodiscard]] pid_t pid() const { return pid_; }
  /// Becomes readable when the process ends; for poll().
  [[nodiscard]] int pidfd() const { return pidfd_.get(); }

  /// Asks the kernel, without waiting, whether the child has ended, and collects it if so. True if
  /// it has ended, now or at an earlier call; then `exit_text()` says how.
  bool Poll();
  /// Whether Poll() has found that it ended.
  [[nodiscard]] bool ended() const { return ended_; }
  /// "exited with status 3", "was killed by signal 9 (Killed)".
  [[nodiscard]] const std::string& exit_text() const { return exit_text_; }
  /// Exit status, or 128 + signal, once ended.
  [[nodiscard]] int status() const { return status_; }

  /// Sends a signal, unless it has ended: its process id may by then be somebody else's.
  void Signal(int signal) const;

 private:
  ChildProcess(std::string name, pid_t pid, int pidfd)
      : name_(std::move(name)), pid_(pid), pidfd_(pidfd) {}

  std::string name_;
  pid_t pid_ = -1;  ///< -1 in an object that was moved from, which then owns no child.
  Descriptor pidfd_;
  /// Set by Poll() alone; `status_` and `exit_text_` mean something only then.
  bool ended_ = false;
  int status_ = 0;
  std::string exit_text_;
};

/// The running executable, whatever it is called: for starting other processes of it. Where it was
/// replaced since it started, the kernel's own name for it, so that all are of one build.
std::string OwnProgram();
/// The path of morphbus-module, which lies beside the running executable. Fails, saying where it
/// was looked for, if there is none.
Result<std::string> ModuleProgram();

}  // namespace morphbus::tools
