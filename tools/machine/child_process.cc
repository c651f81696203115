#include "tools/machine/child_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <utility>

#include "compiler/base/standard_streams.h"

namespace morphbus::tools {
namespace {

/// Runs in the child between fork and exec: only async-signal-safe calls.
[[noreturn]] void BecomeProgram(const ChildProcess::Options& options, char* const* argv,
                                pid_t parent, int report) {
  // The kernel sends it when the parent dies, even by SIGKILL.
  prctl(PR_SET_PDEATHSIG, options.death_signal);
  if (getppid() != parent) _exit(127);  // it died before we could ask to die with it
  // Ctrl-C goes to the launcher alone, which ends the others in order.
  setpgid(0, 0);
  // Signals that the launcher blocks must reach the child.
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  // Nor does it know of what we ignore; programs of ours ignore it themselves.
  RestoreIgnoredSignals();
  // Descriptors close on exec, but for these.
  for (const int fd : options.inherited_fds) fcntl(fd, F_SETFD, 0);
  // A quiet child writes into /dev/null.
  if (options.quiet) {
    const int null = open("/dev/null", O_RDWR | O_CLOEXEC);
    dup2(null, STDOUT_FILENO);
    dup2(null, STDERR_FILENO);
  }
  if (options.input >= 0) dup2(options.input, STDIN_FILENO);
  if (options.output >= 0) dup2(options.output, STDOUT_FILENO);
  if (options.errors >= 0) dup2(options.errors, STDERR_FILENO);
  // execv returns only if it fails; the reason then goes to the parent through the pipe.
  execv(argv[0], argv);
  const int reason = errno;
  const ssize_t told = write(report, &reason, sizeof reason);
  _exit(told < 0 ? 126 : 127);
}

}  // namespace

Result<ChildProcess> ChildProcess::Start(const Options& options) {
  // Made before the fork: the child may not allocate.
  std::vector<char*> argv;
  for (const std::string& argument : options.argv)
    argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  int report[2];  // carries the reason if exec fails; closes when it succeeds
  if (pipe2(report, O_CLOEXEC) != 0)
    return Fail(fmt::format("cannot start {}: {}", options.name, std::strerror(errno)));
  // The child compares this with its parent, in case we die before it has asked for the signal.
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0) BecomeProgram(options, argv.data(), parent, report[1]);
  const int fork_error = errno;
  // Our copy of the end for writing must close, or reading would never end.
  close(report[1]);
  int reason = pid < 0 ? fork_error : 0;
  // The pipe closes without a byte when exec succeeds; else it brings the reason.
  if (pid > 0) {
    ssize_t got = 0;
    do got = read(report[0], &reason, sizeof reason);
    while (got < 0 && errno == EINTR);
  }
  close(report[0]);
  // A child that did not become the program is collected, so that no zombie is left.
  if (reason != 0) {
    if (pid > 0) waitpid(pid, nullptr, 0);
    return Fail(fmt::format("cannot start {} ({}): {}", options.name, options.argv[0],
                            std::strerror(reason)));
  }
  // A pidfd refers to this child even if its number is used again.
  const int pidfd = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
  return ChildProcess(options.name, pid, pidfd);
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : name_(std::move(other.name_)),
      pid_(std::exchange(other.pid_, -1)),
      pidfd_(std::move(other.pidfd_)),
      ended_(other.ended_),
      status_(other.status_),
      exit_text_(std::move(other.exit_text_)) {}

ChildProcess::~ChildProcess() {
  if (pid_ > 0 && !ended_) {
    Signal(SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
}

bool ChildProcess::Poll() {
  int status = 0;
  // waitpid collects the child once; after that its id is free for others.
  if (ended_ || pid_ <= 0 || waitpid(pid_, &status, WNOHANG) != pid_) return ended_;
  ended_ = true;
  if (WIFEXITED(status)) {
    status_ = WEXITSTATUS(status);
    exit_text_ = fmt::format("exited with status {}", status_);
  } else {
    // This is how shells report a signal.
    status_ = 128 + WTERMSIG(status);
    exit_text_ =
        fmt::format("was killed by signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status)));
  }
  return true;
}

void ChildProcess::Signal(int signal) const {
  if (pid_ > 0 && !ended_) kill(pid_, signal);
}

std::string OwnProgram() {
  constexpr const char* kSelf = "/proc/self/exe";
  std::error_code failure;
  const std::filesystem::path path = std::filesystem::read_symlink(kSelf, failure);
  return failure || !std::filesystem::equivalent(path, kSelf, failure) ? kSelf : path.string();
}

Result<std::string> ModuleProgram() {
  std::error_code failure;
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe", failure);
  const std::string program = own.parent_path() / "morphbus-module";
  if (access(program.c_str(), X_OK) == 0) return program;
  return Fail(fmt::format("cannot run {}: {} (it is looked for beside {} alone)", program,
                          std::strerror(errno), own.string()));
}

}  // namespace morphbus::tools
