#include "tools/launch/launcher_link.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>

#include "tools/base/json.h"
#include "tools/machine/wall_clock.h"

namespace morphbus::tools {
namespace {

/// A peer that never ends its line cannot make us grow beyond this.
constexpr size_t kMaxLine = 1 << 20;

/// The newest signal. A handler may do no more than set it.
volatile std::sig_atomic_t g_signal = 0;

/// The handler of the signals that CatchSignals names.
void RememberSignal(int signal) { g_signal = signal; }

}  // namespace

LauncherLink::LauncherLink(int fd) : fd_(fd) {
  if (fd < 0) return;
  // Nobody waits for the other: a process that hangs must not hang its launcher.
  fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) | O_NONBLOCK);
  fcntl(fd, F_SETFD, FD_CLOEXEC);
}

Result<std::pair<LauncherLink, int>> LauncherLink::Create() {
  // Both ends close on exec; Start lets the child inherit its own all the same.
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    return Fail(fmt::format("cannot make a socket: {}", std::strerror(errno)));
  }
  return std::pair<LauncherLink, int>(LauncherLink(ends[0]), ends[1]);
}

void LauncherLink::Send(const nlohmann::ordered_json& message) const {
  if (fd() < 0) return;
  // Half a line would spoil the next one, so only a socket with room gets any.
  pollfd waiting = {fd(), POLLOUT, 0};
  if (poll(&waiting, 1, 0) == 1 && (waiting.revents & POLLOUT) != 0) Deliver(message);
}

void LauncherLink::Deliver(const nlohmann::ordered_json& message, double patience_s) const {
  if (fd() < 0) return;
  const std::string line = JsonText(message) + "\n";
  const WallTimer timer;
  for (size_t done = 0; done < line.size();) {
    const ssize_t n = send(fd(), line.data() + done, line.size() - done, MSG_NOSIGNAL);
    // A socket may take a part of the line, and the rest is tried again.
    if (n > 0) done += static_cast<size_t>(n);
    // Any other error means that the peer is gone: nobody is left to tell.
    if (n < 0 && errno != EAGAIN && errno != EINTR) return;
    // The socket is full: wait, a second at a time so that a peer that is gone is noticed. One that
    // hangs would keep us for ever: it is given up, its line cut.
    if (n < 0 && timer.seconds() > patience_s) return;
    pollfd waiting = {fd(), POLLOUT, 0};
    if (n < 0) poll(&waiting, 1, std::min(1000, static_cast<int>(patience_s * 1e3) + 1));
  }
}

std::vector<nlohmann::ordered_json> LauncherLink::Receive() {
  std::vector<nlohmann::ordered_json> messages;
  char buffer[4096];
  while (fd() >= 0 && !closed_) {
    const ssize_t n = read(fd(), buffer, sizeof buffer);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0 && errno == EAGAIN) break;
    // No bytes are the end of the stream: the peer has closed its end or died.
    if (n <= 0) {
      closed_ = true;
      break;
    }
    // Whole lines become messages; the rest waits for its end.
    pending_.append(buffer, static_cast<size_t>(n));
    for (size_t end = 0; (end = pending_.find('\n')) != std::string::npos;
         pending_.erase(0, end + 1)) {
      nlohmann::ordered_json message =
          nlohmann::ordered_json::parse(pending_.substr(0, end), nullptr, false);
      if (message.is_object()) messages.push_back(std::move(message));
    }
    // A line that is too long is dropped; its rest will be no object and is dropped as well.
    if (pending_.size() > kMaxLine) pending_.clear();
  }
  return messages;
}

void CatchSignals() {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction action = {};
    action.sa_handler = RememberSignal;
    // Repeated calls change nothing, so every command that runs something may call this.
    sigaction(signal, &action, nullptr);  // no SA_RESTART: waiting calls return
  }
}

int CaughtSignal() { return g_signal; }

std::string StopReason(LauncherLink* link,
                       const std::function<void(const nlohmann::ordered_json&)>& other) {
  std::string reason;
  for (const nlohmann::ordered_json& message : link->Receive()) {
    if (message.contains("stop")) {
      reason = message.value("stop", std::string("stopped"));
    } else if (other) {
      other(message);
    }
  }
  // A process without its launcher would run for nobody.
  if (reason.empty() && link->closed()) reason = "the launcher is gone";
  if (reason.empty() && g_signal != 0) reason = g_signal == SIGINT ? "interrupted" : "stopped";
  return reason;
}

void Ticker::OnTime() {
  const int64_t now_us = time_.NowUs();
  if (now_us < next_us_) return;
  // Calls that were missed are not made up for.
  next_us_ = now_us + period_us_;
  call_();
}

}  // namespace morphbus::tools
