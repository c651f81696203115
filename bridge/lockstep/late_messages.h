#pragma once
// The clock of faults on purpose: messages that are late by some time are delivered when it is
// over.

#include <algorithm>
#include <utility>
#include <vector>

#include "bridge/bus/faulty_bus.h"
#include "bridge/lockstep/participant.h"

namespace morphbus::bridge {

/// Takes its turn among the participants whose buses make messages late; the run's time goes on to
/// the next late message as to any other deadline. It comes before the participants, so that a
/// message which is due with a deadline still keeps it.
class LateMessages : public Participant {
 public:
  /// @param buses  outlive this.
  explicit LateMessages(std::vector<FaultyBus*> buses) : buses_(std::move(buses)) {}

  void Start() override {}
  void OnTime() override {
    for (FaultyBus* bus : buses_) bus->DeliverLate();
  }
  [[nodiscard]] int64_t next_deadline_us() const override {
    int64_t next = kNever;
    for (const FaultyBus* bus : buses_) next = std::min(next, bus->next_late_us().value_or(kNever));
    return next;
  }
  /// While nothing is under way; what is comes in the end.
  [[nodiscard]] bool done() const override { return next_deadline_us() == kNever; }

 private:
  std::vector<FaultyBus*> buses_;
};

}  // namespace morphbus::bridge
