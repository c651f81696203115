#pragma once
// What a simulator asks of its launcher, which has the processes: to kill and to restart modules.

#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tools/control/given_command.h"

namespace morphbus::tools {

/// Commands that the launcher carries out, in their order; it says of each when it is done.
class ProcessOrders {
 public:
  /// Tells the launcher to carry one out. A module that begins anew does so under `incarnation`,
  /// else it is 0. Done() may be called at once.
  using Send = std::function<void(const bridge::ControlCommand& command, uint32_t incarnation)>;
  void OnSend(Send send) { send_ = std::move(send); }
  /// Whether there is a launcher to send them to.
  [[nodiscard]] bool possible() const { return static_cast<bool>(send_); }

  /// Hands a command on. There must be a launcher.
  void Order(const GivenCommand& given, uint32_t incarnation);
  /// The launcher has carried out the oldest order, or could not: `done`. Returns it; nothing if
  /// none was under way.
  std::optional<GivenCommand> Done(bool done);

  /// Orders that are under way, oldest first.
  [[nodiscard]] const std::vector<GivenCommand>& under_way() const { return under_way_; }
  /// Forgets those.
  void Clear() { under_way_.clear(); }
  /// Whether there is a module whose process was killed by command and not restarted.
  [[nodiscard]] bool any_killed() const { return !killed_.empty(); }

 private:
  Send send_;
  std::vector<GivenCommand> under_way_;
  std::set<std::string> killed_;
};

/// Modules that begin anew at command in lockstep: between two ticks, when all modules have
/// answered the one before, so that the new process' first tick is certain.
class ColdRestarts {
 public:
  /// What the simulator offers for it.
  struct Sim {
    /// Has `at_barrier` called when all is there for the next tick, which waits for PassBarrier.
    std::function<void(std::function<void()> at_barrier)> set_barrier;
    std::function<void()> pass_barrier;
    /// The number of the next incarnation of the module that a command is about.
    std::function<uint32_t(const bridge::ControlCommand& command)> begin_incarnation;
  };
  /// `orders` outlives this.
  ColdRestarts(ProcessOrders* orders, Sim sim) : orders_(*orders), sim_(std::move(sim)) {}

  /// Takes a restart, which is ordered at the end of the tick that is out.
  void Take(const GivenCommand& given);
  /// To be called when a cold restart is done, well or not: after the last one the next tick
  /// begins.
  void OnDone();

  /// Those that are not ordered yet, oldest first.
  [[nodiscard]] std::vector<GivenCommand>& waiting() { return waiting_; }
  [[nodiscard]] const std::vector<GivenCommand>& waiting() const { return waiting_; }

 private:
  /// Hands those that wait to the launcher, or lets the next tick begin if there are none.
  void AtBarrier();

  ProcessOrders& orders_;
  Sim sim_;
  std::vector<GivenCommand> waiting_;
  int under_way_ = 0;  ///< Ordered at the barrier, and not done yet.
};

}  // namespace morphbus::tools
