#include "bridge/lockstep/sim/module_orders.h"

#include <algorithm>

#include "bridge/wire/vm_codec.h"
#include "compiler/base/check.h"
#include "vm/limits.h"

namespace morphbus::bridge {

ModuleOrders::ModuleOrders(const std::vector<ExpectedModule>& modules) {
  for (const ExpectedModule& module : modules) ids_.push_back(module.id);
}

void ModuleOrders::Invoke(size_t module, const vm::InvokeRequest& request) {
  MORPHBUS_CHECK(module < ids_.size());
  requests_.emplace_back(module, request);
}

void ModuleOrders::AddTo(const std::vector<size_t>& members, morphbus::sensors_t* part) {
  part->requests.clear();
  // SENSORS has room for a few invocations; those behind them wait for the next tick.
  while (!requests_.empty() && std::ranges::count(members, requests_.front().first) > 0 &&
         part->requests.size() < static_cast<size_t>(vm::kMaxRequests)) {
    const auto& [module, request] = requests_.front();
    ToRequest(request, ids_[module], &part->requests.emplace_back());
    requests_.pop_front();
  }
  part->num_requests = static_cast<int8_t>(part->requests.size());
  // A module that is inspected is asked with its own reading.
  part->inspected.clear();
  for (const size_t module : members) {
    if (inspected_.erase(module) > 0) part->inspected.push_back(static_cast<int16_t>(ids_[module]));
  }
  part->num_inspected = static_cast<int8_t>(part->inspected.size());
}

}  // namespace morphbus::bridge
