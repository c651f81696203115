#include "tools/sweep/ssh_engine.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <deque>
#include <memory>

#include "compiler/base/text.h"
#include "tools/base/lines.h"
#include "tools/base/messages.h"
#include "tools/machine/child_process.h"
#include "tools/machine/program_output.h"
#include "tools/machine/wall_clock.h"
#include "tools/sweep/chunk_stream.h"

namespace morphbus::tools {
namespace {

/// How often the engine looks at clocks and signals, milliseconds.
constexpr int kSshLookMs = 100;
/// A host that has not said hello after so long is none, s.
constexpr double kHelloSeconds = 120;
/// ssh that has not ended so long after its stream does not end by itself, s.
constexpr double kSshEndSeconds = 5;
/// Rows that a host has for each that it runs, so that it need not wait for the next one.
constexpr size_t kRowsAhead = 2;
/// So much of what ssh says is kept, bytes.
constexpr size_t kMostWords = 4096;

/// The words that start the program on a host.
Result<std::vector<std::string>> SshCommand(const std::string& ssh, const EngineOptions& options,
                                            const SshHost& host) {
  const Result<std::string> binary = BinaryOf(options.settings, host.binary);
  if (!binary) return Fail(binary.error().message);
  // Nobody is asked for passwords; a network that is gone shows after a minute.
  std::vector<std::string> words = {ssh,  "-T",
                                    "-o", "BatchMode=yes",
                                    "-o", "ConnectTimeout=30",
                                    "-o", "ServerAliveInterval=15",
                                    "-o", "ServerAliveCountMax=4"};
  if (host.port > 0) words.insert(words.end(), {"-p", std::to_string(host.port)});
  words.push_back(host.address);
  std::string command = fmt::format("exec {} sweep worker", ShellWord(*binary));
  const int jobs = options.jobs > 0 ? options.jobs : host.jobs;
  if (jobs > 0) command += fmt::format(" --jobs {}", jobs);
  if (options.timeout_s > 0) command += fmt::format(" --timeout {}", options.timeout_s);
  words.push_back(std::move(command));
  return words;
}

/// A host, and the rows that it has.
class SshConnection {
 public:
  static Result<std::unique_ptr<SshConnection>> Start(const std::string& address,
                                                      std::vector<std::string> argv) {
    int line[2], errors[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, line) != 0) {
      return Fail(fmt::format("cannot make a socket: {}", std::strerror(errno)));
    }
    Descriptor ours(line[0]), theirs(line[1]);
    if (pipe2(errors, O_CLOEXEC) != 0) {
      return Fail(fmt::format("cannot make a pipe: {}", std::strerror(errno)));
    }
    Descriptor said(errors[0]), says(errors[1]);
    ChildProcess::Options options;
    options.name = "ssh";
    options.argv = std::move(argv);
    options.input = options.output = theirs.get();
    options.errors = says.get();
    Result<ChildProcess> process = ChildProcess::Start(options);
    if (!process) return Fail(process.error().message);
    for (const int fd : {ours.get(), said.get()}) {
      fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) | O_NONBLOCK);
    }
    return std::unique_ptr<SshConnection>(
        new SshConnection(address, std::move(ours), std::move(said), std::move(*process)));
  }

  /// Whether it could take a further row.
  [[nodiscard]] bool HasRoom() const {
    return hello_ && flight_.size() < kRowsAhead * static_cast<size_t>(hello_->jobs);
  }

  /// Hands a row over.
  Result<void> Give(RowTask task, RowSource* source) {
    const Result<std::string> lines =
        writer_.LinesOf(task, [source](const std::string& hash) { return source->Part(hash); });
    if (!lines) return Fail(lines.error().message);
    outgoing_ += *lines;
    flight_.push_back(std::move(task));
    return {};
  }

  /// What poll() is to look for.
  void AppendTo(std::vector<pollfd>* fds) const {
    const int events = POLLIN | (outgoing_.empty() ? 0 : POLLOUT);
    fds->push_back({fd_.get(), static_cast<short>(events), 0});
    fds->push_back({errors_.get(), POLLIN, 0});
  }

  /// Writes and reads what can be, and gives results to the source.
  Result<void> Exchange(RowSource* source) {
    std::string words;
    ReadSome(errors_.get(), &words);
    words_ += words;
    if (words_.size() > kMostWords) words_.erase(0, words_.size() - kMostWords);
    if (!outgoing_.empty()) {
      // An end that is gone shows when it is read from.
      const ssize_t sent = send(fd_.get(), outgoing_.data(), outgoing_.size(), MSG_NOSIGNAL);
      if (sent > 0) outgoing_.erase(0, static_cast<size_t>(sent));
    }
    open_ = open_ && ReadSome(fd_.get(), &incoming_);
    while (const std::optional<std::string> line = TakeLine(&incoming_)) {
      if (Result<void> heard = Hear(*line, source); !heard) return heard;
    }
    if (!hello_ && refusal_.empty() && timer_.seconds() > kHelloSeconds) {
      refusal_ = fmt::format("it said nothing within {} s", kHelloSeconds);
    }
    return {};
  }

  /// Why it is of no use any more; empty while it is.
  std::string Loss() {
    if (!refusal_.empty()) return refusal_;
    if (open_) return "";
    // ssh ends a moment after its stream, and says last what the matter was.
    pollfd ended = {process_.pidfd(), POLLIN, 0};
    for (const WallTimer timer; !process_.Poll(); poll(&ended, 1, kSshLookMs)) {
      if (timer.seconds() > kSshEndSeconds) process_.Signal(SIGKILL);
    }
    while (words_.size() < kMostWords && ReadSome(errors_.get(), &words_)) {
      pollfd more = {errors_.get(), POLLIN, 0};
      if (poll(&more, 1, 0) <= 0) break;
    }
    const std::string last = EscapeControl(LastLine(words_));
    const std::string how = "ssh " + process_.exit_text();
    return last.empty() ? how : fmt::format("{} ({})", last, how);
  }

  [[nodiscard]] const std::string& address() const { return address_; }
  [[nodiscard]] bool greeted() const { return hello_.has_value(); }
  [[nodiscard]] bool refused() const { return !refusal_.empty(); }
  [[nodiscard]] const std::deque<RowTask>& flight() const { return flight_; }

 private:
  SshConnection(std::string address, Descriptor fd, Descriptor errors, ChildProcess process)
      : address_(std::move(address)),
        fd_(std::move(fd)),
        errors_(std::move(errors)),
        process_(std::move(process)) {}

  Result<void> Hear(const std::string& line, RowSource* source) {
    if (!hello_) {
      Result<StreamHello> hello = ReadHello(line);
      // What a shell of the host says at every login is none of ours.
      if (!hello) return {};
      const std::string difference = BuildDifference(hello->version, hello->arithmetic);
      if (!difference.empty()) {
        refusal_ = difference;
        return {};
      }
      hello_ = std::move(*hello);
      return {};
    }
    const Result<PlacedResult> result = ReadResult(line);
    if (!result) return {};
    const auto task = std::ranges::find(flight_, result->place, &RowTask::place);
    if (task == flight_.end() || task->key != result->key) return {};
    const RowTask taken = std::move(*task);
    flight_.erase(task);
    return source->Take(taken, result->result);
  }

  std::string address_;
  Descriptor fd_, errors_;
  ChildProcess process_;
  ChunkWriter writer_;
  std::string outgoing_, incoming_, words_;
  std::optional<StreamHello> hello_;
  std::string refusal_;
  bool open_ = true;
  WakingTimer timer_;
  /// Rows without a result, in the order in which they were handed over.
  std::deque<RowTask> flight_;
};

/// All of them.
class SshEngine {
 public:
  SshEngine(const EngineOptions& options, RowSource* source)
      : options_(options), source_(*source) {}

  EngineResult Run() {
    const Result<std::string> ssh = FindProgram("ssh");
    if (!ssh) return NoEngine(ssh.error().message);
    if (options_.settings.hosts.empty()) {
      return NoEngine("the engine ssh needs hosts: [engine] hosts = [\"user@name\"] in the file");
    }
    // Without rows nobody is called.
    if (Result<std::optional<RowTask>> first = NextRow(); !first) {
      return Fail(first.error().message);
    } else if (!*first) {
      return {};
    } else {
      returned_.push_back(std::move(**first));
    }
    for (const SshHost& host : options_.settings.hosts) {
      Result<std::vector<std::string>> words = SshCommand(*ssh, options_, host);
      if (!words) return NoEngine(words.error().message);
      auto started = SshConnection::Start(host.address, std::move(*words));
      if (!started) return Fail(started.error().message);
      hosts_.push_back(std::move(*started));
    }
    return Loop();
  }

 private:
  EngineResult Loop() {
    while (source_.GoOn()) {
      if (Result<bool> given = GiveRows(); !given) {
        return Fail(given.error().message);
      } else if (!*given) {
        return {};
      }
      std::vector<pollfd> fds;
      for (const auto& host : hosts_) host->AppendTo(&fds);
      poll(fds.data(), fds.size(), kSshLookMs);
      for (const auto& host : hosts_) {
        if (Result<void> done = host->Exchange(&source_); !done) return Fail(done.error().message);
      }
      if (EngineResult dropped = DropLost(); !dropped) return dropped;
    }
    return {};
  }

  /// Gives each host what it has room for, in turn. False if there is nothing left to wait for.
  Result<bool> GiveRows() {
    bool more = true, room = true;
    while (more && room) {
      room = false;
      for (const auto& host : hosts_) {
        if (!host->HasRoom()) continue;
        Result<std::optional<RowTask>> row = NextRow();
        if (!row) return Fail(row.error().message);
        more = row->has_value();
        if (!more) break;
        if (Result<void> given = host->Give(std::move(**row), &source_); !given) {
          return Fail(given.error().message);
        }
        room = true;
      }
    }
    const bool idle =
        std::ranges::all_of(hosts_, [](const auto& host) { return host->flight().empty(); });
    return more || !idle;
  }

  /// First those that a host has not done.
  Result<std::optional<RowTask>> NextRow() {
    if (returned_.empty()) return source_.Next();
    RowTask row = std::move(returned_.front());
    returned_.pop_front();
    return std::optional(std::move(row));
  }

  /// Takes rows back from hosts that are of no use any more.
  EngineResult DropLost() {
    bool all_refused = true;
    std::string last;
    for (size_t i = hosts_.size(); i-- > 0;) {
      SshConnection& host = *hosts_[i];
      const std::string loss = host.Loss();
      if (loss.empty()) continue;
      last = fmt::format("{} {}: {}", host.address(),
                         host.refused()   ? "is refused"
                         : host.greeted() ? "was lost"
                                          : "cannot run rows",
                         loss);
      all_refused = all_refused && !host.greeted();
      for (const RowTask& row : host.flight()) returned_.push_back(row);
      if (hosts_.size() > 1) {
        const auto rows = static_cast<int64_t>(host.flight().size());
        Warn(last + (rows == 0 ? "" : fmt::format("; {} to the others", RowsGo(rows))));
      }
      hosts_.erase(hosts_.begin() + static_cast<std::ptrdiff_t>(i));
    }
    any_greeted_ = any_greeted_ || !all_refused;
    if (!hosts_.empty()) return {};
    const std::string message = "no host is left to run rows: " + last;
    if (!any_greeted_) return NoEngine(message);
    return Fail(message);
  }

  static std::string RowsGo(int64_t rows) {
    return Counted(rows, "row") + (rows == 1 ? " goes" : " go");
  }

  const EngineOptions& options_;
  RowSource& source_;
  std::vector<std::unique_ptr<SshConnection>> hosts_;
  /// Rows that were asked for and that no host has.
  std::deque<RowTask> returned_;
  /// One of the hosts that are gone has run rows.
  bool any_greeted_ = false;
};

}  // namespace

EngineResult RunOverSsh(const EngineOptions& options, RowSource* source) {
  return SshEngine(options, source).Run();
}

}  // namespace morphbus::tools
