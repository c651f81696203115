#pragma once
// What modules are told to do from outside, with the SENSORS of a tick.

#include <cstdint>
#include <deque>
#include <morphbus/sensors_t.hpp>
#include <set>
#include <utility>
#include <vector>

#include "bridge/lockstep/sim/run_members.h"
#include "vm/module_api.h"

namespace morphbus::bridge {

/// Orders that wait for a tick: invocations to issue, and modules that shall say what they hold.
/// Modules are called by their place in the run.
class ModuleOrders {
 public:
  explicit ModuleOrders(const std::vector<ExpectedModule>& modules);

  /// Gives a module an invocation to issue, with the next tick that has room.
  void Invoke(size_t module, const vm::InvokeRequest& request);
  /// Asks a module to say in STATUS of the next tick all that it holds.
  void Inspect(size_t module) { inspected_.insert(module); }

  /// Puts what the modules of a part are told into that part, in the place of what stood there.
  /// Invocations leave in the order they came in: the first one that is for another part holds up
  /// the rest.
  /// @param members  the modules of the part.
  void AddTo(const std::vector<size_t>& members, morphbus::sensors_t* part);

 private:
  std::vector<uint16_t> ids_;                                  ///< By place.
  std::deque<std::pair<size_t, vm::InvokeRequest>> requests_;  ///< Oldest first.
  std::set<size_t> inspected_;
};

}  // namespace morphbus::bridge
