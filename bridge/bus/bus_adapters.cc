#include "bridge/bus/bus_adapters.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "compiler/base/text_hash.h"

namespace morphbus::bridge {

/// Which of the endpoints wants what; each channel is subscribed once on the shared bus.
struct BusMux::Impl {
  /// A handler of an endpoint; shared, since it may be replaced while it runs.
  struct Client {
    std::shared_ptr<Bus::Handler> handler;
    Interest interest;
  };
  /// The endpoints that want a channel or prefix, by number and so in order of connection.
  using Route = std::map<int, Client>;
  using Routes = TextTable<Route>;

  /// What all endpoints that want a channel need of it together.
  static Interest Merge(const Route& route) {
    Interest merged = route.begin()->second.interest;
    for (const auto& [number, client] : route) {
      const bool wakes = merged.wakes || client.interest.wakes;
      Interest same = client.interest;
      same.wakes = merged.wakes;
      // An endpoint that needs other messages than the rest makes all of them needed.
      if (same != merged) merged = Interest();
      merged.wakes = wakes;
    }
    return merged;
  }

  /// A handler for the shared bus that passes on to all that want `name`.
  Bus::Handler Distributor(Routes* routes, const std::string& name) {
    return [routes, name](std::string_view channel, const uint8_t* data, size_t size) {
      const auto found = routes->find(name);
      if (found == routes->end()) return;
      // Handlers may change subscriptions, so what is called is a copy.
      if (found->second.size() == 1) {
        const Client client = found->second.begin()->second;
        if (client.interest.Includes(data, size)) (*client.handler)(channel, data, size);
        return;
      }
      const Route route = found->second;
      for (const auto& [number, client] : route) {
        if (client.interest.Includes(data, size)) (*client.handler)(channel, data, size);
      }
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

  /// The same for channels that are told by both ends; all endpoints want the same ones.
  void AddPattern(const std::string& prefix, const std::string& suffix, int endpoint,
                  Bus::Handler handler) {
    Route& route = patterns[prefix];
    const bool first = route.empty();
    route[endpoint] = {std::make_shared<Bus::Handler>(std::move(handler)), Interest()};
    if (first) bus->SubscribeQuietly(prefix, suffix, Distributor(&patterns, prefix));
  }

  /// Drops an endpoint's handler, and the shared subscription with the last one.
  void Remove(Routes* routes, const std::string& name, int endpoint) {
    const auto found = routes->find(name);
    if (found == routes->end()) return;
    found->second.erase(endpoint);
    if (!found->second.empty()) return;
    routes->erase(found);
    // The bus would drop all that has this name together.
    if (!exact.contains(name) && !prefixes.contains(name) && !patterns.contains(name)) {
      bus->Unsubscribe(name);
    }
  }

  /// Notes whether an endpoint waits for any message, and asks the shared bus for what any wants.
  void WakeForAny(int endpoint, bool any) {
    const bool before = !wants_any.empty();
    any ? (void)wants_any.insert(endpoint) : (void)wants_any.erase(endpoint);
    if (before != !wants_any.empty()) bus->WakeForAny(!before);
  }

  Bus* bus;
  int num_endpoints = 0;  ///< That were ever connected.
  // By name of the channel, by prefix, and for what is told by both ends by its prefix.
  Routes exact, prefixes, patterns;
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
    for (Impl::Routes* routes : {&impl_->exact, &impl_->prefixes, &impl_->patterns}) {
      std::vector<std::string> names;
      for (const auto& [name, route] : *routes) names.push_back(name);
      for (const std::string& name : names) impl_->Remove(routes, name, number_);
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
  void SubscribeQuietly(const std::string& prefix, const std::string& suffix,
                        Handler handler) override {
    impl_->AddPattern(prefix, suffix, number_, std::move(handler));
  }
  void WakeForAny(bool any) override { impl_->WakeForAny(number_, any); }
  void Unsubscribe(const std::string& channel) override {
    impl_->Remove(&impl_->exact, channel, number_);
    impl_->Remove(&impl_->prefixes, channel, number_);
    impl_->Remove(&impl_->patterns, channel, number_);
  }

 private:
  Impl* impl_;
  int number_;
};

BusMux::BusMux(Bus* bus) : impl_(std::make_unique<Impl>()) { impl_->bus = bus; }
BusMux::~BusMux() = default;

std::unique_ptr<Bus> BusMux::Connect() { return std::make_unique<Endpoint>(impl_.get()); }

}  // namespace morphbus::bridge
