#pragma once
// A bus within one process and one thread: --inproc runs and tests. Deterministic: every endpoint
// gets messages in order of publication.

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "bridge/bus.h"

namespace morphbus::bridge {

class InprocEndpoint;

/// Where endpoints meet. Must outlive them.
class InprocHub {
 public:
  InprocHub();
  ~InprocHub();
  InprocHub(const InprocHub&) = delete;
  InprocHub& operator=(const InprocHub&) = delete;

  /// A bus of its own for one party; receives also what it publishes itself, as on LCM.
  std::unique_ptr<Bus> Connect();

  /// Dispatches what waits now, endpoint by endpoint in order of connection.
  /// Returns the number of messages dispatched.
  int HandleRound();
  /// The same until nothing waits.
  int HandleAll();

 private:
  friend class InprocEndpoint;
  std::vector<InprocEndpoint*> endpoints_;
};

}  // namespace morphbus::bridge
