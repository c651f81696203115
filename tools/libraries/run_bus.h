#pragma once
// How a member of a run of one's own reaches the bus.

#include <morphbus/bus/address.h>
#include <morphbus/failure.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <utility>

#include "bridge/bus/bus.h"
#include "bridge/lockstep/participant.h"

namespace morphbus {

/// A run's bus, with its key.
class RunBus {
 public:
  /// Opens it. Throws Failure where the name, the URL or the key cannot be used.
  explicit RunBus(const RunAddress& address);
  [[nodiscard]] bridge::Bus* bus() { return sealed_.get(); }

 private:
  std::unique_ptr<bridge::Bus> lcm_, sealed_;
};

/// Calls a function some times a second beside the participants of a run, which it never keeps
/// going itself.
class Watch : public bridge::Participant {
 public:
  /// `time` outlives the watch.
  Watch(const bridge::TimeSource* time, std::function<void()> call)
      : time_(time), call_(std::move(call)) {}
  void Start() override {}
  void OnTime() override;
  [[nodiscard]] int64_t next_deadline_us() const override { return next_us_; }
  [[nodiscard]] bool done() const override { return true; }

 private:
  const bridge::TimeSource* time_;
  std::function<void()> call_;
  int64_t next_us_ = 0;
};

}  // namespace morphbus
