#pragma once
// The launcher's private line to a process it started: JSON objects, one a line, both ways, over a
// socket that only the two hold. Its end tells each that the other is gone.

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "bridge/party.h"
#include "compiler/source/result.h"

namespace morphbus::tools {

class ControlLink {
 public:
  /// Takes over a descriptor, e.g. from --control-fd; -1: a link to nobody, that never says
  /// anything.
  explicit ControlLink(int fd);
  ControlLink(ControlLink&& other) noexcept;
  ControlLink& operator=(ControlLink&&) = delete;
  ControlLink(const ControlLink&) = delete;
  ControlLink& operator=(const ControlLink&) = delete;
  ~ControlLink();

  /// The two ends of a new link; the descriptor of the second is for a child to inherit.
  static Result<std::pair<ControlLink, int>> Create();

  /// Never blocks; what a full socket does not take is lost (progress), but see `Deliver`.
  void Send(const nlohmann::ordered_json& message) const;
  /// As Send, but waits until the other end has room or is gone.
  void Deliver(const nlohmann::ordered_json& message) const;
  /// What has arrived; never blocks. Lines over 1 MiB or that are no objects are ignored.
  std::vector<nlohmann::ordered_json> Receive();
  /// True once the other end is gone.
  [[nodiscard]] bool closed() const { return closed_; }
  [[nodiscard]] int fd() const { return fd_; }

 private:
  int fd_ = -1;
  bool closed_ = false;
  std::string pending_;
};

/// From now on SIGINT, SIGTERM and SIGHUP only set a flag.
void CatchSignals();
/// The signal caught so far; 0: none.
int CaughtSignal();
/// Why this process should end now: the launcher says {"stop": reason} or is gone, or a signal was
/// caught. Empty: no reason.
std::string StopReason(ControlLink* link);

/// Calls a function every so often beside the parties of a run, and never keeps the run going
/// itself.
class Ticker : public bridge::Party {
 public:
  Ticker(int64_t period_us, std::function<void()> call)
      : period_us_(period_us), call_(std::move(call)) {}

  void Start() override {}
  void OnTime() override;
  [[nodiscard]] int64_t next_deadline_us() const override { return next_us_; }
  [[nodiscard]] bool done() const override { return true; }
  [[nodiscard]] const bridge::Ledger& ledger() const override { return ledger_; }

 private:
  int64_t period_us_;
  std::function<void()> call_;
  bridge::MonotonicTime time_;
  bridge::Ledger ledger_;
  int64_t next_us_ = 0;
};

}  // namespace morphbus::tools
