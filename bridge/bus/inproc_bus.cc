#include "bridge/bus/inproc_bus.h"

#include <algorithm>
#include <utility>

#include "bridge/bus/lcm_bus.h"
#include "compiler/base/check.h"

namespace morphbus::bridge {

/// One participant's end of the hub.
class InprocEndpoint : public Bus {
 public:
  explicit InprocEndpoint(InprocHub* hub) : hub_(hub) { hub_->endpoints_.push_back(this); }
  ~InprocEndpoint() override {
    std::erase(hub_->endpoints_, this);
    std::erase(hub_->broad_listeners_, this);
    for (const auto& [channel, handler] : subscriptions_.exact()) StopListening(channel);
    DropPattern();
    ++hub_->num_changes_;
    for (size_t i = handled_; i < queue_.size(); ++i) hub_->Release(queue_[i].message);
  }
  InprocEndpoint(const InprocEndpoint&) = delete;
  InprocEndpoint& operator=(const InprocEndpoint&) = delete;

  void Publish(const std::string& channel, const uint8_t* data, size_t size) override {
    // One copy of the bytes for all receivers, none where there is no listener.
    Message* message = nullptr;
    const auto fill = [&] {
      if (message != nullptr) return;
      message = hub_->NewMessage();
      message->channel = channel;
      message->bytes.assign(data, data + size);
      message->num_waiting = 1;  // Ours.
    };
    const auto deliver = [&](InprocEndpoint* endpoint, const Subscriptions::Exact* subscription) {
      fill();
      endpoint->Enqueue(message, subscription);
    };
    Deliver(channel, data, size, deliver);
    if (MatchesPattern(channel)) {
      fill();
      hub_->KeepEarly(message);
    }
    if (message != nullptr) hub_->Release(message);
  }

  void Receive(const Channels& channels, Handler handler) override {
    if (channels.by == Channels::By::kBothEnds) {
      DropPattern();
      // The handler is never called: messages come once their channels are subscribed to.
      subscriptions_.Add(channels, std::move(handler));
      ++hub_->patterns_[{channels.name, channels.suffix}];
      return;
    }
    ++hub_->num_changes_;
    const Subscriptions::Exact* subscription = subscriptions_.Add(channels, std::move(handler));
    if (subscription == nullptr) return NoteBreadth();
    std::vector<InprocHub::Listener>& listeners = hub_->listeners_[channels.name];
    const auto known = std::find_if(listeners.begin(), listeners.end(),
                                    [this](const auto& l) { return l.endpoint == this; });
    if (known != listeners.end()) {
      known->interest = channels.interest;
      return;
    }
    listeners.push_back({this, channels.interest, subscription});
    // What came before it was known that this channel is wanted.
    const auto early = hub_->early_.find(channels.name);
    if (early != hub_->early_.end() && subscriptions_.pattern().Matches(channels.name)) {
      Enqueue(early->second, subscription);
    }
  }

  void Unsubscribe(const std::string& channel) override {
    ++hub_->num_changes_;
    if (const auto exact = subscriptions_.exact().find(channel);
        exact != subscriptions_.exact().end()) {
      StopListening(channel);
      // Messages that wait for it have no receiver now, also if the channel is subscribed to again;
      // only an endpoint that has prefixes, too, gets what waits by its name.
      static const Subscriptions::Exact kNobody;
      for (Waiting& waiting : queue_) {
        if (waiting.subscription == exact->second.get()) waiting.subscription = &kNobody;
      }
    }
    if (channel == subscriptions_.pattern().prefix) DropPattern();
    subscriptions_.Remove(channel);
    NoteBreadth();
  }

  int HandleFor(int64_t /*timeout_us*/) override {
    // The places of messages that have been handled are used again.
    queue_.erase(queue_.begin(), queue_.begin() + static_cast<std::ptrdiff_t>(handled_));
    handled_ = 0;
    // In the first tick all endpoints hear what concerns all of them, and later only a little.
    constexpr size_t kUsualQueue = 256;
    if (queue_.empty() && queue_.capacity() > kUsualQueue) queue_.shrink_to_fit();
    // What arrives meanwhile is for the next round: a participant that talks to itself must come
    // back. A handler may call this, too, and then goes on with the same queue.
    int count = 0;
    for (size_t left = queue_.size(); left > 0 && handled_ < queue_.size(); --left, ++count) {
      const Waiting next = queue_[handled_++];
      const Message& message = *next.message;
      const InHand in_hand{hub_, next.message};
      if (next.subscription != nullptr && !broad_) {
        Subscriptions::Dispatch(*next.subscription, message.channel, message.bytes.data(),
                                message.bytes.size());
      } else {
        subscriptions_.Dispatch(message.channel, message.bytes.data(), message.bytes.size());
      }
    }
    return count;
  }

 private:
  using Message = InprocHub::Message;
  /// A message to be handled, and the one subscription that it is for; null if others may match.
  struct Waiting {
    Message* message;
    const Subscriptions::Exact* subscription;
  };
  /// Gives the message back when its handlers have returned, also by an exception.
  struct InHand {
    InprocHub* hub;
    Message* message;
    InHand(InprocHub* of, Message* what) : hub(of), message(what) {}
    InHand(const InHand&) = delete;
    InHand& operator=(const InHand&) = delete;
    ~InHand() { hub->Release(message); }
  };

  /// The endpoints that get what is published on a channel, as long as no endpoint changes what it
  /// listens to.
  struct Route {
    std::string channel;
    int64_t num_changes = -1;  ///< The hub's count when this was looked up.
    /// The endpoints that want it among those that listen to many channels, and those that listen
    /// to just this one; null if none does.
    std::vector<InprocEndpoint*> broad;
    const std::vector<InprocHub::Listener>* exact = nullptr;
  };

  /// The route of a channel. A participant publishes on its few channels in the same order tick by
  /// tick, so that the one that is looked at first is mostly the right one.
  const Route& RouteOf(const std::string& channel) {
    constexpr size_t kMostRoutes = 8;
    const size_t count = routes_.size();
    for (size_t tries = 0; tries < count; ++tries) {
      Route& route = routes_[next_route_];
      next_route_ = next_route_ + 1 < count ? next_route_ + 1 : 0;
      if (route.channel != channel) continue;
      if (route.num_changes != hub_->num_changes_) LookUp(channel, &route);
      return route;
    }
    // An endpoint with more channels than are kept here forgets one of them.
    const size_t place = count < kMostRoutes ? count : next_route_;
    if (place == count) routes_.emplace_back();
    next_route_ = place + 1 < routes_.size() ? place + 1 : 0;
    LookUp(channel, &routes_[place]);
    return routes_[place];
  }

  void LookUp(const std::string& channel, Route* route) {
    route->channel = channel;
    route->num_changes = hub_->num_changes_;
    route->broad.clear();
    for (InprocEndpoint* endpoint : hub_->broad_listeners_) {
      if (endpoint->subscriptions_.Wants(channel)) route->broad.push_back(endpoint);
    }
    const auto listeners = hub_->listeners_.find(channel);
    route->exact = listeners == hub_->listeners_.end() ? nullptr : &listeners->second;
  }

  /// Calls `deliver` with every endpoint that wants the message, and the subscription that it is
  /// for; null if several may match.
  template <class Deliverer>
  void Deliver(const std::string& channel, const uint8_t* data, size_t size,
               const Deliverer& deliver) {
    const Route& route = RouteOf(channel);
    for (InprocEndpoint* endpoint : route.broad) deliver(endpoint, nullptr);
    if (route.exact == nullptr) return;
    // Of a channel in parts nearly all need another part, so what they need is looked at first.
    for (const InprocHub::Listener& listener : *route.exact) {
      if (!listener.interest.Includes(data, size)) continue;
      // Broad listeners have it already.
      if (!listener.endpoint->broad_) deliver(listener.endpoint, listener.subscription);
    }
  }

  /// The hub no longer counts us among those that listen to the channel.
  void StopListening(const std::string& channel) {
    const auto found = hub_->listeners_.find(channel);
    std::erase_if(found->second, [this](const auto& l) { return l.endpoint == this; });
    if (found->second.empty()) hub_->listeners_.erase(found);
  }

  /// Whether some endpoint listens quietly to such channels.
  [[nodiscard]] bool MatchesPattern(const std::string& channel) const {
    return std::ranges::any_of(hub_->patterns_, [&](const auto& pattern) {
      const auto& [prefix, suffix] = pattern.first;
      return Subscriptions::Pattern{prefix, suffix, nullptr}.Matches(channel);
    });
  }

  /// The hub no longer counts us among those that listen quietly.
  void DropPattern() {
    const Subscriptions::Pattern& pattern = subscriptions_.pattern();
    if (!pattern.prefix.empty()) hub_->DropPattern(pattern.prefix, pattern.suffix);
  }

  /// The hub asks those whose subscriptions may match any channel for each one.
  void NoteBreadth() {
    const bool broad = !subscriptions_.prefixes().empty();
    if (broad == broad_) return;
    broad_ = broad;
    if (broad) hub_->broad_listeners_.push_back(this);
    if (!broad) std::erase(hub_->broad_listeners_, this);
  }

  void Enqueue(Message* message, const Subscriptions::Exact* subscription) {
    ++message->num_waiting;
    queue_.push_back({message, subscription});
  }

  // Subscriptions by name, and what waits to be handled. A message that several endpoints wait for
  // is shared by their queues.
  InprocHub* hub_;
  Subscriptions subscriptions_;
  /// True if prefixes are among the subscriptions.
  bool broad_ = false;
  /// The channels that were published on last, and the place of the one that is expected next.
  std::vector<Route> routes_;
  size_t next_route_ = 0;
  std::vector<Waiting> queue_;
  size_t handled_ = 0;  ///< So many at its beginning have been handled.
};

InprocHub::Message* InprocHub::NewMessage() {
  if (spare_.empty()) return std::make_unique<Message>().release();
  Message* message = spare_.back().release();
  spare_.pop_back();
  return message;
}

void InprocHub::Release(Message* message) {
  constexpr size_t kMostSpare = 4 * kBusQueueDepth;
  if (--message->num_waiting > 0) return;
  std::unique_ptr<Message> done(message);
  if (spare_.size() < kMostSpare) spare_.push_back(std::move(done));
}

void InprocHub::KeepEarly(Message* message) {
  if (early_.try_emplace(message->channel, message).second) ++message->num_waiting;
}

void InprocHub::DropPattern(const std::string& prefix, const std::string& suffix) {
  const auto found = patterns_.find({prefix, suffix});
  if (--found->second > 0) return;
  patterns_.erase(found);
  if (!patterns_.empty()) return;
  for (const auto& [channel, message] : early_) Release(message);
  early_.clear();
}

InprocHub::InprocHub() = default;
InprocHub::~InprocHub() { MORPHBUS_CHECK(endpoints_.empty()); }

std::unique_ptr<Bus> InprocHub::Connect() { return std::make_unique<InprocEndpoint>(this); }

int InprocHub::HandleRound() {
  int count = 0;
  // Handlers may connect further endpoints.
  for (size_t i = 0; i < endpoints_.size(); ++i) count += endpoints_[i]->Handle(0);
  return count;
}

int InprocHub::HandleAll() {
  int total = 0;
  for (int round = HandleRound(); round != 0; round = HandleRound()) total += round;
  return total;
}

}  // namespace morphbus::bridge
