#include "tools/sweep/local_engine.h"

#include <fmt/format.h>
#include <poll.h>
#include <sched.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "tools/base/descriptor.h"
#include "tools/base/lines.h"
#include "tools/base/messages.h"
#include "tools/machine/child_process.h"
#include "tools/machine/wall_clock.h"

namespace morphbus::tools {
namespace {

/// How often the engine looks at clocks and signals, milliseconds.
constexpr int kLookMs = 100;

/// A process, and the row that it runs.
class Worker {
 public:
  static Result<std::unique_ptr<Worker>> Start(const std::string& binary) {
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
      return Fail(fmt::format("cannot make a socket: {}", std::strerror(errno)));
    }
    Descriptor ours(ends[0]), theirs(ends[1]);
    ChildProcess::Options options;
    options.name = "a process of the sweep";
    options.argv = {binary.empty() ? OwnProgram() : binary, "sweep", "worker", "--fd",
                    std::to_string(theirs.get())};
    options.inherited_fds = {theirs.get()};
    options.quiet = true;
    Result<ChildProcess> process = ChildProcess::Start(options);
    if (!process) return Fail(process.error().message);
    return std::unique_ptr<Worker>(new Worker(std::move(ours), std::move(*process)));
  }

  /// Hands a row over, with those of its parts that the process does not have.
  Result<void> Give(RowTask task, double limit_s, RowSource* source) {
    const Result<std::string> lines =
        writer_.LinesOf(task, [source](const std::string& hash) { return source->Part(hash); });
    if (!lines) return Fail(lines.error().message);
    // One that is gone shows by its end of the socket.
    WriteWhole(fd(), *lines);
    task_ = std::move(task);
    limit_s_ = limit_s;
    timer_ = std::make_unique<WakingTimer>();
    return {};
  }

  /// Reads what came. True if the row's result is there, which `result` then gets; `gone` if the
  /// process has closed its end.
  bool Receive(RowResult* result, bool* gone) {
    *gone = !ReadSome(fd(), &buffer_);
    const std::optional<std::string> line = TakeLine(&buffer_);
    if (!line) return false;
    Result<PlacedResult> read = ReadResult(*line);
    if (!read || !task_ || read->place != task_->place) return false;
    *result = std::move(read->result);
    return true;
  }

  /// How the process ended, once it has closed its end.
  std::string AwaitEnd() {
    // The kernel closes its descriptors a moment before it is gone.
    pollfd ended = {process_.pidfd(), POLLIN, 0};
    while (!process_.Poll()) poll(&ended, 1, kLookMs);
    return process_.exit_text();
  }

  [[nodiscard]] int fd() const { return fd_.get(); }
  [[nodiscard]] bool late() { return task_ && timer_->seconds() > limit_s_; }
  [[nodiscard]] double limit_s() const { return limit_s_; }
  [[nodiscard]] const std::optional<RowTask>& task() const { return task_; }
  std::optional<RowTask> TakeTask() { return std::exchange(task_, std::nullopt); }

 private:
  Worker(Descriptor fd, ChildProcess process) : fd_(std::move(fd)), process_(std::move(process)) {}

  Descriptor fd_;
  ChildProcess process_;
  std::string buffer_;
  std::optional<RowTask> task_;
  ChunkWriter writer_;
  double limit_s_ = 0;
  std::unique_ptr<WakingTimer> timer_;
};

/// All of them.
class LocalEngine {
 public:
  LocalEngine(const LocalOptions& options, RowSource* source)
      : options_(options), source_(*source) {}

  Result<void> Run() {
    if (Result<void> filled = Fill(); !filled) return filled;
    const bool final = source_.arrivals() < 0;
    while ((!final || !workers_.empty()) && source_.GoOn()) {
      // Rows that have arrived begin where a process is free.
      if (!final) {
        if (Result<void> filled = Fill(); !filled) return filled;
      }
      std::vector<pollfd> fds;
      for (const auto& worker : workers_) fds.push_back({worker->fd(), POLLIN, 0});
      const size_t running = fds.size();
      // A descriptor that is none is left alone.
      fds.push_back({source_.arrivals(), POLLIN, 0});
      poll(fds.data(), fds.size(), kLookMs);
      // Those that are done leave the list, so that it is gone through from its end.
      for (size_t i = running; i-- > 0;) {
        if (Result<void> looked = Look(i, fds[i].revents != 0); !looked) return looked;
      }
    }
    return {};
  }

 private:
  /// Gives rows to processes until there are as many as there may be, or no rows.
  Result<void> Fill() {
    drained_ = false;
    while (static_cast<int>(workers_.size()) < options_.jobs && !drained_) {
      if (Result<void> begun = Begin(nullptr); !begun) return begun;
    }
    return {};
  }

  /// Gives the next row to a worker, or to a new one. Without one it is let go.
  Result<void> Begin(std::unique_ptr<Worker> worker) {
    Result<std::optional<RowTask>> task = source_.Next();
    if (!task) return Fail(task.error().message);
    drained_ = !*task;
    if (drained_) return {};
    if (!worker) {
      Result<std::unique_ptr<Worker>> started = Worker::Start(options_.binary);
      if (!started) return Fail(started.error().message);
      worker = std::move(*started);
    }
    const double limit =
        options_.timeout_s > 0 ? options_.timeout_s : 60 + 20 * SimSecondsOf((*task)->inputs);
    if (Result<void> given = worker->Give(std::move(**task), limit, &source_); !given) return given;
    workers_.push_back(std::move(worker));
    return {};
  }

  /// Looks after one worker: what it says, and whether its time is over.
  Result<void> Look(size_t index, bool speaks) {
    RowResult result = NewResult();
    bool gone = false;
    const bool answered = speaks && workers_[index]->Receive(&result, &gone);
    const bool late = !answered && !gone && workers_[index]->late();
    if (!answered && !gone && !late) return {};
    std::unique_ptr<Worker> worker = std::move(workers_[index]);
    workers_.erase(workers_.begin() + static_cast<std::ptrdiff_t>(index));
    const RowTask task = *worker->TakeTask();
    if (gone && !answered) {
      result.status = RowResult::Status::kCrashed;
      result.error = "its process " + worker->AwaitEnd();
    } else if (late) {
      result.status = RowResult::Status::kTimeout;
      result.error = fmt::format("it was not done after {:g} s", worker->limit_s());
    }
    // A process that hangs or crashed is none for the next row.
    if (!answered) worker.reset();
    // The process goes on before the result is put away; if it cannot, the result counts all the
    // same.
    const Result<void> begun = Begin(std::move(worker));
    const Result<void> taken = source_.Take(task, result);
    return begun ? taken : begun;
  }

  const LocalOptions& options_;
  RowSource& source_;
  std::vector<std::unique_ptr<Worker>> workers_;
  /// There are no rows (now).
  bool drained_ = false;
};

}  // namespace

int ProcessorCount() {
  // In a container or job these are fewer than the machine has.
  cpu_set_t set;
  CPU_ZERO(&set);
  if (sched_getaffinity(0, sizeof set, &set) == 0) return std::max(1, CPU_COUNT(&set));
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

double SimSecondsOf(const RowInputs& inputs) {
  proto::RunDescription own;
  return own.ParseFromString(inputs.own) ? own.seconds() : 0;
}

Result<void> RunLocally(const LocalOptions& options, RowSource* source) {
  return LocalEngine(options, source).Run();
}

int ServeRows(int fd) {
  // These are for the whole sweep, which ends this process by closing the socket or by SIGKILL.
  // They are blocked and not ignored, for each run catches them, and would end before its time.
  sigset_t stops;
  sigemptyset(&stops);
  for (const int stop : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&stops, stop);
  sigprocmask(SIG_BLOCK, &stops, nullptr);
  ChunkRunner runner;
  std::string buffer;
  while (ReadSome(fd, &buffer)) {
    while (const std::optional<std::string> line = TakeLine(&buffer)) {
      const Result<std::optional<std::string>> answer = runner.Take(*line);
      // Only another program than this one writes lines that cannot be read.
      if (!answer) return Unusable(answer.error().message);
      if (*answer && !WriteWhole(fd, **answer)) return kDone;
    }
  }
  return kDone;
}

}  // namespace morphbus::tools
