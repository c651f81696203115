#pragma once
// Buses around buses: a common base, and several participants on one bus.

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

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
  void Receive(const Channels& channels, Handler handler) override {
    inner_->Receive(channels, std::move(handler));
  }
  void Unsubscribe(const std::string& channel) override { inner_->Unsubscribe(channel); }
  void BatchSubscriptions(bool batch) override { inner_->BatchSubscriptions(batch); }
  void WakeForAny(bool any) override { inner_->WakeForAny(any); }
  int HandleFor(int64_t timeout_us) override { return inner_->HandleFor(timeout_us); }
  [[nodiscard]] BusLosses losses() const override { return inner_->losses(); }
  [[nodiscard]] const UnauthenticCounts& unauthentic() const override {
    return inner_->unauthentic();
  }

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
  /// @param bus  the shared one, on which nothing else subscribes.
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

}  // namespace morphbus::bridge
