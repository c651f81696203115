#include "bridge/bus/inproc_bus.h"

#include <algorithm>
#include <map>
#include <utility>

#include "bridge/bus/lcm_bus.h"
#include "compiler/base/check.h"

namespace morphbus::bridge {

/// One participant's end of the hub.
class InprocEndpoint : public Bus {
 public:
  explicit InprocEndpoint(InprocHub* hub) : hub_(hub) { hub_->endpoints_.push_back(this); }
  ~InprocEndpoint() override {
    auto& all = hub_->endpoints_;
    all.erase(std::remove(all.begin(), all.end(), this), all.end());
  }
  InprocEndpoint(const InprocEndpoint&) = delete;
  InprocEndpoint& operator=(const InprocEndpoint&) = delete;

  void Publish(const std::string& channel, const uint8_t* data, size_t size) override {
    // One copy of the bytes for all receivers, none where nobody listens.
    std::shared_ptr<Message> message;
    for (InprocEndpoint* endpoint : hub_->endpoints_) {
      if (!endpoint->Wants(channel)) continue;
      if (message == nullptr) {
        message = std::make_shared<Message>(Message{channel, {data, data + size}});
      }
      endpoint->Enqueue(message);
    }
  }

  void Subscribe(const std::string& channel, Handler handler) override {
    // The old handler may be running just now; whoever runs it holds on to it.
    exact_[channel] = std::make_shared<Handler>(std::move(handler));
  }

  void SubscribePrefix(const std::string& prefix, Handler handler) override {
    prefixes_[prefix] = std::make_shared<Handler>(std::move(handler));
  }

  void Unsubscribe(const std::string& channel) override {
    exact_.erase(channel);
    prefixes_.erase(channel);
  }

  int Handle(int /*timeout_ms*/) override {
    int count = 0;
    // What arrives meanwhile is for the next round: a participant that talks to itself must come
    // back.
    for (size_t left = queue_.size(); left > 0 && !queue_.empty(); --left, ++count) {
      const std::shared_ptr<Message> message = std::move(queue_.front());
      queue_.pop_front();
      Dispatch(*message);
    }
    return count;
  }

  [[nodiscard]] int64_t queue_overflows() const override { return overflows_; }

 private:
  struct Message {
    std::string channel;
    std::vector<uint8_t> bytes;
  };

  /// Whether any subscription matches the channel.
  [[nodiscard]] bool Wants(const std::string& channel) const {
    return exact_.contains(channel) ||
           std::any_of(prefixes_.begin(), prefixes_.end(),
                       [&](const auto& entry) { return channel.starts_with(entry.first); });
  }

  void Enqueue(const std::shared_ptr<Message>& message) {
    // As deep as a real socket's queue, and as silent about what does not fit: the ledger counts
    // it.
    if (queue_.size() >= kBusQueueDepth) {
      ++overflows_;
      return;
    }
    queue_.push_back(message);
  }

  /// Calls the handlers that match: first the channel's own, then the prefixes' in order of prefix.
  void Dispatch(const Message& message) {
    // Handlers may subscribe and unsubscribe, themselves too: hold on to the one that runs.
    if (const auto it = exact_.find(message.channel); it != exact_.end()) {
      const std::shared_ptr<Handler> handler = it->second;
      (*handler)(message.channel, message.bytes.data(), message.bytes.size());
    }
    // The prefixes that match now, whatever their handlers change.
    std::vector<std::shared_ptr<Handler>> matching;
    for (const auto& [prefix, handler] : prefixes_) {
      if (message.channel.starts_with(prefix)) matching.push_back(handler);
    }
    for (const auto& handler : matching) {
      (*handler)(message.channel, message.bytes.data(), message.bytes.size());
    }
  }

  // Subscriptions by name, and what waits to be handled. A message that several endpoints wait for
  // is shared by their queues.
  InprocHub* hub_;
  std::map<std::string, std::shared_ptr<Handler>> exact_, prefixes_;
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
