#pragma once
// Buses around buses: several participants on one bus, and loss on purpose.

#include <cstdint>
#include <memory>
#include <string>

#include "bridge/bus/bus.h"

namespace morphbus::bridge {

/// A bus around another one, to which it leaves all that a derived class does not do itself.
class ForwardingBus : public Bus {
 public:
  /// @param inner  outlives this bus.
  explicit ForwardingBus(Bus* inner) : inner_(inner) {}

  // As in Bus.
  void Publish(const std::string& channel, const uint8_t* data, size_t size) override {
    inner_->Publish(channel, data, size);
  }
  void Unsubscribe(const std::string& channel) override { inner_->Unsubscribe(channel); }
  void WakeForAny(bool any) override { inner_->WakeForAny(any); }
  int HandleFor(int64_t timeout_us) override { return inner_->HandleFor(timeout_us); }
  [[nodiscard]] int64_t queue_overflows() const override { return inner_->queue_overflows(); }
  [[nodiscard]] int64_t discarded() const override { return inner_->discarded(); }

 protected:
  /// Not owned.
  Bus* inner_;
};

/// Lets several participants of one process share one bus, each with its own subscriptions: a
/// hundred modules in one process need one socket. Messages go to the participants in order of
/// Connect(). Handle() of an endpoint handles the shared bus for all. Endpoints must not outlive
/// the mux, nor the mux the bus.
class BusMux {
 public:
  /// @param bus  the shared one, which nobody else subscribes on.
  explicit BusMux(Bus* bus);
  ~BusMux();

  /// A participant's own endpoint; what it subscribed to ends with it.
  std::unique_ptr<Bus> Connect();

 private:
  // Who wants what, and the endpoints that know it.
  struct Impl;
  class Endpoint;
  std::unique_ptr<Impl> impl_;
};

/// Throws away a fraction of what arrives, the same on every run with the same seed and arrivals
/// (splitmix64, one draw a message). Publishing is left alone: loss is at the receiver.
class LossyBus : public ForwardingBus {
 public:
  /// @param inner  outlives this bus.
  /// @param loss   probability 0..1 with which a message is thrown away.
  /// @param seed   of the random numbers; the same seed loses the same messages.
  LossyBus(Bus* inner, double loss, uint64_t seed);

  // As in Bus; what is received may be lost.
  using Bus::Subscribe;
  void Subscribe(const std::string& channel, Handler handler, const Interest& interest) override;
  void SubscribePrefix(const std::string& prefix, Handler handler) override;
  [[nodiscard]] int64_t discarded() const override { return discarded_; }

 private:
  /// Draws whether the next message is lost.
  bool Drop();
  /// A handler that passes on what is not lost.
  Handler Wrap(Handler handler);

  /// A message is lost if a random number below 2^53 is below this.
  uint64_t threshold_;
  /// Of the random numbers: splitmix64's counter.
  uint64_t state_;
  /// Messages thrown away so far.
  int64_t discarded_ = 0;
};

}  // namespace morphbus::bridge
