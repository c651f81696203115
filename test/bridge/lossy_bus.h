#pragma once
// A bus that loses some of what arrives.

#include <cstdint>

#include "bridge/bus/faulty_bus.h"

namespace morphbus::bridge {

/// Throws away a fraction of what arrives, and does nothing else.
class LossyBus : public FaultyBus {
 public:
  /// @param inner  outlives this bus.
  /// @param loss   probability 0..1 with which a message is thrown away.
  /// @param seed   of the random numbers; the same seed loses the same messages.
  LossyBus(Bus* inner, double loss, uint64_t seed)
      : FaultyBus(inner, WithLoss({}, loss, seed), "") {}
};

}  // namespace morphbus::bridge
