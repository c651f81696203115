#include "tools/health_sender.h"

#include "bridge/codec.h"
#include "bridge/health.h"

namespace morphbus::tools {

HealthSender::HealthSender(bridge::Bus* bus, const RunPlan& plan, const std::string& process)
    : process_(process),
      channel_(bridge::Channel(plan.description.run(), process, bridge::Topic::kHealth)),
      outbox_(bus, {plan.description.run(), process, plan.description.model_hash(), 0}, &unused_) {}

void HealthSender::Send(const bridge::Ledger& ledger, int64_t discarded) {
  morphbus::health_t health = bridge::MakeHealth(process_, ledger);
  health.discarded = discarded;
  outbox_.Send(channel_, 0, 0, &health);
}

HealthListener::HealthListener(bridge::Bus* bus, const std::string& run,
                               const std::vector<std::string>& processes) {
  for (const std::string& process : processes) {
    bus->Subscribe(bridge::Channel(run, process, bridge::Topic::kHealth),
                   [this, process](std::string_view, const uint8_t* data, size_t size) {
                     morphbus::health_t health;
                     if (bridge::Decode(data, size, {}, &health)) table_[process] = health;
                   });
  }
}

}  // namespace morphbus::tools
