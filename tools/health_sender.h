#pragma once
// Publishes a process's HEALTH, and gathers that of others.

#include <map>
#include <memory>
#include <morphbus/health_t.hpp>
#include <string>

#include "bridge/bus.h"
#include "bridge/outbox.h"
#include "tools/run_plan.h"

namespace morphbus::tools {

class HealthSender {
 public:
  /// `bus` outlives the sender.
  HealthSender(bridge::Bus* bus, const RunPlan& plan, const std::string& process);
  /// Publishes the ledger, with what a LossyBus `discarded` on purpose.
  void Send(const bridge::Ledger& ledger, int64_t discarded);

 private:
  std::string process_;
  std::string channel_;
  bridge::Ledger unused_;
  bridge::Outbox outbox_;
};

/// The newest HEALTH of each process of a run, by process.
using HealthTable = std::map<std::string, morphbus::health_t>;

/// Listens to exactly these processes' HEALTH on `bus` and keeps the newest.
class HealthListener {
 public:
  HealthListener(bridge::Bus* bus, const std::string& run,
                 const std::vector<std::string>& processes);
  [[nodiscard]] const HealthTable& table() const { return table_; }

 private:
  HealthTable table_;
};

}  // namespace morphbus::tools
