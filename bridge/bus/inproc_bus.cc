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
    for (size_t i = handled_; i < queue_.size(); ++i) hub_->Release(queue_[i].message);
  }
  InprocEndpoint(const InprocEndpoint&) = delete;
  InprocEndpoint& operator=(const InprocEndpoint&) = delete;

  void Publish(const std::string& channel, const uint8_t* data, size_t size) override {
    // One copy of the bytes for all receivers, none where nobody listens.
    Message* message = nullptr;
    const auto deliver = [&](InprocEndpoint* endpoint,
                             std::shared_ptr<Subscriptions::Exact> subscription) {
      if (message == nullptr) {
        message = hub_->NewMessage();
        message->channel = channel;
        message->bytes.assign(data, data + size);
        message->num_waiting = 1;  // Ours.
      }
      endpoint->Enqueue(message, std::move(subscription));
    };
    Deliver(channel, data, size, deliver);
    if (message != nullptr) hub_->Release(message);
  }

  using Bus::Subscribe;
  void Subscribe(const std::string& channel, Handler handler, const Interest& interest) override {
    std::shared_ptr<Subscriptions::Exact> subscription =
        subscriptions_.Add(channel, std::move(handler));
    std::vector<InprocHub::Listener>& listeners = hub_->listeners_[channel];
    const auto known = std::find_if(listeners.begin(), listeners.end(),
                                    [this](const auto& l) { return l.endpoint == this; });
    if (known == listeners.end()) {
      listeners.push_back({this, interest, std::move(subscription)});
    } else {
      known->interest = interest;
    }
  }

  void SubscribePrefix(const std::string& prefix, Handler handler) override {
    subscriptions_.AddPrefix(prefix, std::move(handler));
    NoteBreadth();
  }

  void SubscribeQuietly(const std::string& prefix, const std::string& suffix,
                        Handler handler) override {
    subscriptions_.SetPattern(prefix, suffix, std::move(handler));
    NoteBreadth();
  }

  void Unsubscribe(const std::string& channel) override {
    if (subscriptions_.exact().contains(channel)) StopListening(channel);
    subscriptions_.Remove(channel);
    NoteBreadth();
  }

  int HandleFor(int64_t /*timeout_us*/) override {
    // The places of messages that have been handled are used again.
    queue_.erase(queue_.begin(), queue_.begin() + static_cast<std::ptrdiff_t>(handled_));
    handled_ = 0;
    // What arrives meanwhile is for the next round: a participant that talks to itself must come
    // back. A handler may call this, too, and then goes on with the same queue.
    int count = 0;
    for (size_t left = queue_.size(); left > 0 && handled_ < queue_.size(); --left, ++count) {
      const Waiting next = std::move(queue_[handled_++]);
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

  [[nodiscard]] int64_t queue_overflows() const override { return overflows_; }

 private:
  using Message = InprocHub::Message;
  /// A message to be handled, and the one subscription that it is for; null if others may match.
  struct Waiting {
    Message* message;
    std::shared_ptr<Subscriptions::Exact> subscription;
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

  /// Calls `deliver` with everybody who wants the message, and the subscription that it is for;
  /// null if several may match.
  template <class Deliverer>
  void Deliver(const std::string& channel, const uint8_t* data, size_t size,
               const Deliverer& deliver) {
    for (InprocEndpoint* endpoint : hub_->broad_listeners_) {
      if (endpoint->subscriptions_.Wants(channel)) deliver(endpoint, nullptr);
    }
    const auto listeners = hub_->listeners_.find(channel);
    if (listeners == hub_->listeners_.end()) return;
    // Of a channel in parts nearly all need another part, so what they need is looked at first.
    for (const InprocHub::Listener& listener : listeners->second) {
      if (!listener.interest.Includes(data, size)) continue;
      // Broad listeners have it already.
      if (!listener.endpoint->broad_) deliver(listener.endpoint, listener.subscription);
    }
  }

  /// The hub no longer counts us among those who listen to the channel.
  void StopListening(const std::string& channel) {
    const auto found = hub_->listeners_.find(channel);
    std::erase_if(found->second, [this](const auto& l) { return l.endpoint == this; });
    if (found->second.empty()) hub_->listeners_.erase(found);
  }

  /// The hub asks those whose subscriptions may match any channel for each one.
  void NoteBreadth() {
    const bool broad = !subscriptions_.prefixes().empty() || subscriptions_.pattern().handler;
    if (broad == broad_) return;
    broad_ = broad;
    if (broad) hub_->broad_listeners_.push_back(this);
    if (!broad) std::erase(hub_->broad_listeners_, this);
  }

  void Enqueue(Message* message, std::shared_ptr<Subscriptions::Exact> subscription) {
    // As deep as a real socket's queue, and as silent about what does not fit: the ledger counts
    // it.
    if (queue_.size() - handled_ >= kBusQueueDepth) {
      ++overflows_;
      return;
    }
    ++message->num_waiting;
    queue_.push_back({message, std::move(subscription)});
  }

  // Subscriptions by name, and what waits to be handled. A message that several endpoints wait for
  // is shared by their queues.
  InprocHub* hub_;
  Subscriptions subscriptions_;
  /// True if prefixes or a pattern are among the subscriptions.
  bool broad_ = false;
  std::vector<Waiting> queue_;
  size_t handled_ = 0;  ///< So many at its beginning have been handled.
  int64_t overflows_ = 0;
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
