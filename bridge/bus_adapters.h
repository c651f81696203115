#pragma once
// Buses around buses: several parties on one bus, and loss on purpose.

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bridge/bus.h"

namespace morphbus::bridge {

/// Lets several parties of one process share one bus, each with its own subscriptions. Messages go
/// to the parties in order of Connect(). Handle() of an endpoint handles the shared bus for all.
/// Endpoints must not outlive the mux, nor the mux the bus.
class BusMux {
 public:
  explicit BusMux(Bus* bus);
  ~BusMux();
  BusMux(const BusMux&) = delete;
  BusMux& operator=(const BusMux&) = delete;

  std::unique_ptr<Bus> Connect();

 private:
  struct Impl;
  class Endpoint;
  std::unique_ptr<Impl> impl_;
};

/// Throws away a fraction of what arrives, the same on every run with the same seed and arrivals
/// (splitmix64, one draw a message). Publishing is left alone: loss is at the receiver.
class LossyBus : public Bus {
 public:
  /// @param loss       probability 0..1.
  /// @param discarded  counts what was thrown away; outlives the bus.
  LossyBus(Bus* inner, double loss, uint64_t seed, int64_t* discarded);

  void Publish(const std::string& channel, const uint8_t* data, size_t size) override;
  void Subscribe(const std::string& channel, Handler handler) override;
  void SubscribePrefix(const std::string& prefix, Handler handler) override;
  void Unsubscribe(const std::string& channel) override;
  int Handle(int timeout_ms) override;
  [[nodiscard]] int64_t queue_overflows() const override;
  [[nodiscard]] int64_t discarded() const override { return *discarded_; }

 private:
  bool Drop();
  Handler Wrap(Handler handler);

  Bus* inner_;
  uint64_t threshold_;  ///< Of 2^53.
  uint64_t state_;
  int64_t* discarded_;
};

}  // namespace morphbus::bridge
