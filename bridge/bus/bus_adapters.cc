#include "bridge/bus/bus_adapters.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

namespace morphbus::bridge {

/// Who of the endpoints wants what; each channel is subscribed once on the shared bus.
struct BusMux::Impl {
  /// A handler of an endpoint; shared, since it may be replaced while it runs.
  struct Client {
    std::shared_ptr<Bus::Handler> handler;
    Interest interest;
  };
  /// Who wants a channel or prefix, by number and so in order of connection.
  using Route = std::map<int, Client>;
  using Routes = std::map<std::string, Route>;

  /// What all who want a channel need of it together.
  static Interest Merge(const Route& route) {
    Interest merged = route.begin()->second.interest;
    for (const auto& [number, client] : route) {
      const bool wakes = merged.wakes || client.interest.wakes;
      Interest same = client.interest;
      same.wakes = merged.wakes;
      // Whoever needs other messages than the rest makes all of them needed.
      if (same != merged) merged = Interest();
      merged.wakes = wakes;
    }
    return merged;
  }

  /// A handler for the shared bus that passes on to all who want `name`.
  Bus::Handler Distributor(Routes* routes, const std::string& name) {
    return [routes, name](std::string_view channel, const uint8_t* data, size_t size) {
      const auto found = routes->find(name);
      if (found == routes->end()) return;
      // Handlers may change subscriptions: walk over a copy.
      const Route route = found->second;
      for (const auto& [number, client] : route) (*client.handler)(channel, data, size);
    };
  }

  /// Adds an endpoint's handler for a channel, or replaces it, as on any bus.
  void Add(const std::string& name, int endpoint, Bus::Handler handler, const Interest& interest) {
    Route& route = exact[name];
    const Interest before = route.empty() ? Interest() : Merge(route);
    const bool first = route.empty();
    route[endpoint] = {std::make_shared<Bus::Handler>(std::move(handler)), interest};
    // The shared bus is asked only by the first endpoint that wants the channel, or more of it.
    const Interest now = Merge(route);
    if (first || now != before) bus->Subscribe(name, Distributor(&exact, name), now);
  }

  /// The same for a prefix.
  void AddPrefix(const std::string& name, int endpoint, Bus::Handler handler) {
    Route& route = prefixes[name];
    const bool first = route.empty();
    route[endpoint] = {std::make_shared<Bus::Handler>(std::move(handler)), Interest()};
    if (first) bus->SubscribePrefix(name, Distributor(&prefixes, name));
  }

  /// Drops an endpoint's handler, and the shared subscription with the last one.
  void Remove(Routes* routes, const std::string& name, int endpoint) {
    const auto found = routes->find(name);
    if (found == routes->end()) return;
    found->second.erase(endpoint);
    if (!found->second.empty()) return;
    routes->erase(found);
    // The bus would drop a channel and a prefix of the same name together.
    if (!exact.contains(name) && !prefixes.contains(name)) bus->Unsubscribe(name);
  }

  /// Notes whether an endpoint waits for any message, and asks the shared bus for what any wants.
  void WakeForAny(int endpoint, bool any) {
    const bool before = !wants_any.empty();
    any ? (void)wants_any.insert(endpoint) : (void)wants_any.erase(endpoint);
    if (before != !wants_any.empty()) bus->WakeForAny(!before);
  }

  Bus* bus;
  int num_endpoints = 0;  ///< That were ever connected.
  // By name of the channel, and by prefix.
  Routes exact, prefixes;
  /// Endpoints for which every message shall end a wait.
  std::set<int> wants_any;
};

/// One participant's view of the shared bus.
class BusMux::Endpoint : public ForwardingBus {
 public:
  explicit Endpoint(Impl* impl)
      : ForwardingBus(impl->bus), impl_(impl), number_(impl->num_endpoints++) {}
  ~Endpoint() override {
    // An endpoint that goes takes its subscriptions along.
    impl_->WakeForAny(number_, false);
    for (Impl::Routes* routes : {&impl_->exact, &impl_->prefixes}) {
      for (auto it = routes->begin(); it != routes->end();) {
        const std::string name = (it++)->first;
        impl_->Remove(routes, name, number_);
      }
    }
  }
  Endpoint(const Endpoint&) = delete;
  Endpoint& operator=(const Endpoint&) = delete;

  using Bus::Subscribe;
  void Subscribe(const std::string& channel, Handler handler, const Interest& interest) override {
    impl_->Add(channel, number_, std::move(handler), interest);
  }
  void SubscribePrefix(const std::string& prefix, Handler handler) override {
    impl_->AddPrefix(prefix, number_, std::move(handler));
  }
  void WakeForAny(bool any) override { impl_->WakeForAny(number_, any); }
  void Unsubscribe(const std::string& channel) override {
    impl_->Remove(&impl_->exact, channel, number_);
    impl_->Remove(&impl_->prefixes, channel, number_);
  }

 private:
  Impl* impl_;
  int number_;
};

BusMux::BusMux(Bus* bus) : impl_(std::make_unique<Impl>()) { impl_->bus = bus; }
BusMux::~BusMux() = default;

std::unique_ptr<Bus> BusMux::Connect() { return std::make_unique<Endpoint>(impl_.get()); }

LossyBus::LossyBus(Bus* inner, double loss, uint64_t seed)
    : ForwardingBus(inner),
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

void LossyBus::Subscribe(const std::string& channel, Handler handler, const Interest& interest) {
  inner_->Subscribe(channel, Wrap(std::move(handler)), interest);
}
void LossyBus::SubscribePrefix(const std::string& prefix, Handler handler) {
  inner_->SubscribePrefix(prefix, Wrap(std::move(handler)));
}

}  // namespace morphbus::bridge
