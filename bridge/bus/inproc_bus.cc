#include "bridge/bus/inproc_bus.h"

#include <utility>

#include "bridge/bus/lcm_bus.h"
#include "bridge/bus/subscriptions.h"
#include "compiler/base/check.h"

namespace morphbus::bridge {

/// One participant's end of the hub.
class InprocEndpoint : public Bus {
 public:
  explicit InprocEndpoint(InprocHub* hub) : hub_(hub) { hub_->endpoints_.push_back(this); }
  ~InprocEndpoint() override { std::erase(hub_->endpoints_, this); }
  InprocEndpoint(const InprocEndpoint&) = delete;
  InprocEndpoint& operator=(const InprocEndpoint&) = delete;

  void Publish(const std::string& channel, const uint8_t* data, size_t size) override {
    // One copy of the bytes for all receivers, none where nobody listens.
    std::shared_ptr<Message> message;
    for (InprocEndpoint* endpoint : hub_->endpoints_) {
      if (!endpoint->subscriptions_.Wants(channel)) continue;
      if (message == nullptr) {
        message = std::make_shared<Message>(Message{channel, {data, data + size}});
      }
      endpoint->Enqueue(message);
    }
  }

  using Bus::Subscribe;
  void Subscribe(const std::string& channel, Handler handler, const Interest&) override {
    subscriptions_.Add(channel, std::move(handler));
  }

  void SubscribePrefix(const std::string& prefix, Handler handler) override {
    subscriptions_.AddPrefix(prefix, std::move(handler));
  }

  void Unsubscribe(const std::string& channel) override { subscriptions_.Remove(channel); }

  int HandleFor(int64_t /*timeout_us*/) override {
    int count = 0;
    // What arrives meanwhile is for the next round: a participant that talks to itself must come
    // back.
    for (size_t left = queue_.size(); left > 0 && !queue_.empty(); --left, ++count) {
      const std::shared_ptr<Message> message = std::move(queue_.front());
      queue_.pop_front();
      subscriptions_.Dispatch(message->channel, message->bytes.data(), message->bytes.size());
    }
    return count;
  }

  [[nodiscard]] int64_t queue_overflows() const override { return overflows_; }

 private:
  struct Message {
    std::string channel;
    std::vector<uint8_t> bytes;
  };

  void Enqueue(const std::shared_ptr<Message>& message) {
    // As deep as a real socket's queue, and as silent about what does not fit: the ledger counts
    // it.
    if (queue_.size() >= kBusQueueDepth) {
      ++overflows_;
      return;
    }
    queue_.push_back(message);
  }

  // Subscriptions by name, and what waits to be handled. A message that several endpoints wait for
  // is shared by their queues.
  InprocHub* hub_;
  Subscriptions subscriptions_;
  std::deque<std::shared_ptr<Message>> queue_;
  int64_t overflows_ = 0;
};

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
