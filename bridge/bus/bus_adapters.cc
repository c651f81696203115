#include "bridge/bus/bus_adapters.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace morphbus::bridge {

/// Who of the endpoints wants what; each channel is subscribed once on the shared bus.
struct BusMux::Impl {
  /// Who wants a channel or prefix, in order of connection. A handler is shared, since it may be
  /// replaced while it runs.
  using Route = std::vector<std::pair<const Endpoint*, std::shared_ptr<Bus::Handler>>>;

  explicit Impl(Bus* b) : bus(b) {}

  /// Adds an endpoint's handler for a name.
  void Add(std::map<std::string, Route>* routes, const std::string& name, const Endpoint* endpoint,
           Bus::Handler handler) {
    Route& route = (*routes)[name];
    // Subscribing again replaces the handler, as on any bus.
    for (auto& [owner, old] : route) {
      if (owner == endpoint) {
        old = std::make_shared<Bus::Handler>(std::move(handler));
        return;
      }
    }
    // Endpoints hear a message in the order in which they were connected, not subscribed.
    route.emplace_back(endpoint, std::make_shared<Bus::Handler>(std::move(handler)));
    std::stable_sort(route.begin(), route.end(), [this](const auto& a, const auto& b) {
      return Rank(a.first) < Rank(b.first);
    });
  }

  /// Place of an endpoint in the order of connection.
  size_t Rank(const Endpoint* endpoint) const {
    return static_cast<size_t>(std::find(order.begin(), order.end(), endpoint) - order.begin());
  }

  /// Calls the handlers of one subscription with a message.
  static void Dispatch(const std::map<std::string, Route>& routes, const std::string& name,
                       std::string_view channel, const uint8_t* data, size_t size) {
    const auto found = routes.find(name);
    if (found == routes.end()) return;
    // Handlers may change subscriptions: walk over a copy.
    const Route route = found->second;
    for (const auto& [endpoint, handler] : route) (*handler)(channel, data, size);
  }

  /// Drops an endpoint's handler, and the shared subscription with the last one.
  void Remove(std::map<std::string, Route>* routes, const std::string& name,
              const Endpoint* endpoint) {
    const auto found = routes->find(name);
    if (found == routes->end()) return;
    std::erase_if(found->second, [endpoint](const auto& entry) { return entry.first == endpoint; });
    if (!found->second.empty()) return;
    routes->erase(found);
    // The bus would drop a channel and a prefix of the same name together.
    if (!exact.contains(name) && !prefixes.contains(name)) bus->Unsubscribe(name);
  }

  Bus* bus;
  std::vector<const Endpoint*> order;
  // By name of the channel, and by prefix.
  std::map<std::string, Route> exact, prefixes;
};

/// One participant's view of the shared bus.
class BusMux::Endpoint : public Bus {
 public:
  explicit Endpoint(Impl* impl) : impl_(impl) { impl_->order.push_back(this); }
  ~Endpoint() override {
    // An endpoint that goes takes its subscriptions along.
    for (auto* routes : {&impl_->exact, &impl_->prefixes}) {
      std::vector<std::string> names;
      for (const auto& [name, route] : *routes) names.push_back(name);
      for (const std::string& name : names) impl_->Remove(routes, name, this);
    }
    std::erase(impl_->order, this);
  }
  Endpoint(const Endpoint&) = delete;
  Endpoint& operator=(const Endpoint&) = delete;

  void Publish(const std::string& channel, const uint8_t* data, size_t size) override {
    impl_->bus->Publish(channel, data, size);
  }

  void Subscribe(const std::string& channel, Handler handler) override {
    // The shared bus is asked only by the first endpoint that wants the channel.
    const bool known = impl_->exact.contains(channel);
    impl_->Add(&impl_->exact, channel, this, std::move(handler));
    if (known) return;
    impl_->bus->Subscribe(
        channel, [impl = impl_, channel](std::string_view name, const uint8_t* data, size_t size) {
          Impl::Dispatch(impl->exact, channel, name, data, size);
        });
  }

  void SubscribePrefix(const std::string& prefix, Handler handler) override {
    const bool known = impl_->prefixes.contains(prefix);
    impl_->Add(&impl_->prefixes, prefix, this, std::move(handler));
    if (known) return;
    impl_->bus->SubscribePrefix(
        prefix, [impl = impl_, prefix](std::string_view name, const uint8_t* data, size_t size) {
          Impl::Dispatch(impl->prefixes, prefix, name, data, size);
        });
  }

  void Unsubscribe(const std::string& channel) override {
    impl_->Remove(&impl_->exact, channel, this);
    impl_->Remove(&impl_->prefixes, channel, this);
  }

  int Handle(int timeout_ms) override { return impl_->bus->Handle(timeout_ms); }
  [[nodiscard]] int64_t queue_overflows() const override { return impl_->bus->queue_overflows(); }
  [[nodiscard]] int64_t discarded() const override { return impl_->bus->discarded(); }

 private:
  Impl* impl_;
};

BusMux::BusMux(Bus* bus) : impl_(std::make_unique<Impl>(bus)) {}
BusMux::~BusMux() = default;

std::unique_ptr<Bus> BusMux::Connect() { return std::make_unique<Endpoint>(impl_.get()); }

LossyBus::LossyBus(Bus* inner, double loss, uint64_t seed)
    : inner_(inner),
      threshold_(static_cast<uint64_t>(std::ldexp(std::clamp(loss, 0.0, 1.0), 53))),
      state_(seed) {}

bool LossyBus::Drop() {
  // splitmix64 (Steele, Lea, Flood 2014): one step a message, so that runs can be repeated.
  state_ += 0x9e3779b97f4a7c15ULL;
  uint64_t z = state_;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  z ^= z >> 31;
  // The upper 53 bits, as many as a double holds exactly.
  return (z >> 11) < threshold_;
}

Bus::Handler LossyBus::Wrap(Handler handler) {
  return [this, inner = std::move(handler)](std::string_view channel, const uint8_t* data,
                                            size_t size) {
    if (Drop()) {
      ++discarded_;
      return;
    }
    inner(channel, data, size);
  };
}

// Everything else is the inner bus's work.
void LossyBus::Publish(const std::string& channel, const uint8_t* data, size_t size) {
  inner_->Publish(channel, data, size);
}
void LossyBus::Subscribe(const std::string& channel, Handler handler) {
  inner_->Subscribe(channel, Wrap(std::move(handler)));
}
void LossyBus::SubscribePrefix(const std::string& prefix, Handler handler) {
  inner_->SubscribePrefix(prefix, Wrap(std::move(handler)));
}
void LossyBus::Unsubscribe(const std::string& channel) { inner_->Unsubscribe(channel); }
int LossyBus::Handle(int timeout_ms) { return inner_->Handle(timeout_ms); }
int64_t LossyBus::queue_overflows() const { return inner_->queue_overflows(); }

}  // namespace morphbus::bridge
