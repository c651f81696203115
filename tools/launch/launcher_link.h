#pragma once
// The launcher's private line to a process it started: JSON objects, one a line, both ways, over a
// socket that only the two hold. Its end tells each that the other is gone.

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "bridge/lockstep/participant.h"
#include "compiler/base/result.h"
#include "tools/base/descriptor.h"

namespace morphbus::tools {

/// One end of the line; it owns its descriptor and closes it. The launcher sends {"stop": reason},
/// and {"ordered": error} when it has killed or restarted a module, which the sim orders by
/// {"order": "kill" or "restart", "module": name, "incarnation": number}; the sim sends {"tick": …,
/// "gone": […]} as it goes and {"outcome": …} at the end; the logger sends {"log": path, …} or
/// {"error": …}. None of this is part of the run: it is never logged, and no hash covers it.
class LauncherLink {
 public:
  /// Takes over a descriptor, e.g. from --launcher-fd; -1: a link to nobody, that never says
  /// anything.
  explicit LauncherLink(int fd);

  /// The two ends of a new link; the descriptor of the second is for a child to inherit, and the
  /// caller closes it once the child has started. Fails if the system has no socket left.
  static Result<std::pair<LauncherLink, int>> Create();

  /// Sends a message that may be lost, such as progress: a socket without room gets nothing of it,
  /// so that this does not wait for the other end. What must arrive is sent with `Deliver`.
  void Send(const nlohmann::ordered_json& message) const;
  /// As Send, but waits until the other end has room or is gone, for some `patience_s`
  /// seconds at most: one that hangs gets no more than a part of the line.
  void Deliver(const nlohmann::ordered_json& message, double patience_s = 5.0) const;
  /// What has arrived; never blocks. Lines over 1 MiB or that are no objects are ignored.
  std::vector<nlohmann::ordered_json> Receive();
  /// True once the other end is gone.
  [[nodiscard]] bool closed() const { return closed_; }
  /// The descriptor for poll(), readable when a message or the end has come; -1 for a link to
  /// nobody.
  [[nodiscard]] int fd() const { return fd_.get(); }

 private:
  Descriptor fd_;
  bool closed_ = false;
  std::string pending_;  ///< The beginning of a line whose end has not arrived.
};

/// From now on SIGINT, SIGTERM and SIGHUP only set a flag, which CaughtSignal() reads, so that the
/// run can be ended in order. System calls that wait return with EINTR.
void CatchSignals();
/// The signal caught so far; 0: none.
int CaughtSignal();
/// Why this process should end now: the launcher says {"stop": reason} or is gone, or a signal was
/// caught. The result is empty where there is no reason. It reads the link, hands every message but
/// {"stop"} to `other` (if given), and never blocks.
std::string StopReason(LauncherLink* link,
                       const std::function<void(const nlohmann::ordered_json&)>& other = nullptr);

/// Microseconds of wall time between two looks at the launcher, at signals and at the log.
inline constexpr int64_t kWatchUs = 50000;

/// Calls a function every so often beside the participants of a run, and never keeps the run going
/// itself. It is a Participant because the loop that runs these wakes up in time for the next one.
class Ticker : public bridge::Participant {
 public:
  /// @param period_us  microseconds of wall time between two calls.
  Ticker(int64_t period_us, std::function<void()> call)
      : period_us_(period_us), call_(std::move(call)) {}

  void Start() override {}
  void OnTime() override;
  [[nodiscard]] int64_t next_deadline_us() const override { return next_us_; }
  /// Always, so that the run does not wait for it.
  [[nodiscard]] bool done() const override { return true; }

 private:
  int64_t period_us_;
  std::function<void()> call_;
  /// The wall's monotonic clock, also in a run whose participants go by virtual time.
  bridge::MonotonicTime time_;
  /// When to call next, on `time_`; 0 makes the first call happen at once.
  int64_t next_us_ = 0;
};

}  // namespace morphbus::tools
