#include "bridge/bus/bus_adapters.h"

#include <map>
#include <set>
#include <utility>
#include <vector>

#include "compiler/base/text_hash.h"

namespace morphbus::bridge {

/// Which of the endpoints wants what; the same channels are subscribed to once on the shared bus.
struct BusMux::Impl {
  /// A handler of an endpoint; shared, since it may be replaced while it runs.
  struct Client {
    std::shared_ptr<Bus::Handler> handler;
    Interest interest;
  };
  /// The endpoints that want the same channels, by number and so in order of connection.
  using Route = std::map<int, Client>;

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

  /// A handler for the shared bus that passes on to all on a route.
  static Bus::Handler Distributor(const std::shared_ptr<Route>& to) {
    return [to](std::string_view channel, const uint8_t* data, size_t size) {
      // Handlers may change subscriptions, so what is called is a copy.
      if (to->size() == 1) {
        const Client client = to->begin()->second;
        if (client.interest.Includes(data, size)) (*client.handler)(channel, data, size);
        return;
      }
      const Route route = *to;
      for (const auto& [number, client] : route) {
        if (client.interest.Includes(data, size)) (*client.handler)(channel, data, size);
      }
    };
  }

  /// Adds an endpoint's handler for channels, or replaces it, as on any bus.
  void Add(const Channels& channels, int endpoint, Bus::Handler handler) {
    std::shared_ptr<Route>& route = routes[channels.name][channels.by];
    if (route == nullptr) route = std::make_shared<Route>();
    const bool first = route->empty();
    const Interest before = first ? Interest() : Merge(*route);
    (*route)[endpoint] = {std::make_shared<Bus::Handler>(std::move(handler)), channels.interest};
    // The shared bus is asked only by the first endpoint that wants the channels, or more of them.
    Channels shared = channels;
    shared.interest = Merge(*route);
    if (first || before != shared.interest) bus->Receive(shared, Distributor(route));
  }

  /// Drops an endpoint's handlers under a name, and the shared subscriptions with the last one.
  void Remove(const std::string& name, int endpoint) {
    const auto found = routes.find(name);
    if (found == routes.end()) return;
    for (const auto& [by, route] : found->second) route->erase(endpoint);
    std::erase_if(found->second, [](const auto& entry) { return entry.second->empty(); });
    // The bus drops all that has this name together.
    if (!found->second.empty()) return;
    routes.erase(found);
    bus->Unsubscribe(name);
  }

  /// Notes whether an endpoint waits for any message, and asks the shared bus for what any wants.
  void WakeForAny(int endpoint, bool any) {
    const bool before = !wants_any.empty();
    any ? (void)wants_any.insert(endpoint) : (void)wants_any.erase(endpoint);
    if (before != !wants_any.empty()) bus->WakeForAny(!before);
  }

  Bus* bus;
  int num_endpoints = 0;  ///< That were ever connected.
  /// By the channels' name, and then by what it says of them.
  TextTable<std::map<Channels::By, std::shared_ptr<Route>>> routes;
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
    std::vector<std::string> names;
    for (const auto& [name, routes] : impl_->routes) names.push_back(name);
    for (const std::string& name : names) impl_->Remove(name, number_);
  }
  Endpoint(const Endpoint&) = delete;
  Endpoint& operator=(const Endpoint&) = delete;

  void Receive(const Channels& channels, Handler handler) override {
    impl_->Add(channels, number_, std::move(handler));
  }
  void WakeForAny(bool any) override { impl_->WakeForAny(number_, any); }
  void Unsubscribe(const std::string& channel) override { impl_->Remove(channel, number_); }

 private:
  Impl* impl_;
  int number_;
};

BusMux::BusMux(Bus* bus) : impl_(std::make_unique<Impl>()) { impl_->bus = bus; }
BusMux::~BusMux() = default;

std::unique_ptr<Bus> BusMux::Connect() { return std::make_unique<Endpoint>(impl_.get()); }

}  // namespace morphbus::bridge
