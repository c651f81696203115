#include "bridge/lcm_bus.h"

#include <arpa/inet.h>
#include <dirent.h>
#include <lcm/lcm.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <cstdlib>
#include <cstring>
#include <deque>
#include <map>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "bridge/channel_filter.h"
#include "bridge/lcm_url.h"

namespace morphbus::bridge {
namespace {

/// UDP sockets of this process that are bound to `port`.
std::set<int> SocketsOnPort(uint16_t port) {
  std::set<int> sockets;
  DIR* directory = opendir("/proc/self/fd");
  if (directory == nullptr) return sockets;
  // NOLINTNEXTLINE(concurrency-mt-unsafe): the stream is ours alone.
  while (const dirent* entry = readdir(directory)) {
    const int fd = std::atoi(static_cast<const char*>(entry->d_name));
    int type = 0;
    socklen_t size = sizeof type;
    if (getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_DGRAM) continue;
    sockaddr_in address = {};
    size = sizeof address;
    if (getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) != 0) continue;
    if (address.sin_family == AF_INET && ntohs(address.sin_port) == port) sockets.insert(fd);
  }
  closedir(directory);
  return sockets;
}

/// LCM takes subscriptions as regular expressions.
std::string EscapeForRegex(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       c == '_' || c == '/' || c == '-';
    if (!plain) escaped += '\\';
    escaped += c;
  }
  return escaped;
}

class LcmBus : public Bus {
 public:
  LcmBus(lcm_t* lcm, LcmUrl url) : lcm_(lcm), url_(std::move(url)) {}

  ~LcmBus() override {
    exact_.clear();
    prefixes_.clear();
    lcm_destroy(lcm_);
  }
  LcmBus(const LcmBus&) = delete;
  LcmBus& operator=(const LcmBus&) = delete;

  void Publish(const std::string& channel, const uint8_t* data, size_t size) override {
    // A failure (no buffer space) is a lost message like any other: the receivers' ledgers show it.
    lcm_publish(lcm_, channel.c_str(), data, static_cast<unsigned>(size));
  }

  void Subscribe(const std::string& channel, Handler handler) override {
    Add(&exact_, channel, EscapeForRegex(channel), std::move(handler));
  }

  void SubscribePrefix(const std::string& prefix, Handler handler) override {
    Add(&prefixes_, prefix, EscapeForRegex(prefix) + ".*", std::move(handler));
  }

  void Unsubscribe(const std::string& channel) override {
    if (exact_.erase(channel) + prefixes_.erase(channel) > 0) UpdateFilter();
  }

  int Handle(int timeout_ms) override {
    if (queue_.empty()) WaitAndDrain(timeout_ms);
    int count = 0;
    for (size_t left = queue_.size(); left > 0 && !queue_.empty(); --left, ++count) {
      Message message = std::move(queue_.front());
      queue_.pop_front();
      const std::shared_ptr<Subscription> subscription = message.subscription.lock();
      if (subscription == nullptr) continue;  // Unsubscribed meanwhile.
      subscription->handler(message.channel, message.bytes.data(), message.bytes.size());
    }
    return count;
  }

  [[nodiscard]] int64_t queue_overflows() const override { return overflows_; }

 private:
  struct Subscription {
    Subscription(LcmBus* b, Handler h) : bus(b), handler(std::move(h)) {}
    ~Subscription() {
      if (lcm_subscription != nullptr) lcm_unsubscribe(bus->lcm_, lcm_subscription);
    }
    Subscription(const Subscription&) = delete;
    Subscription& operator=(const Subscription&) = delete;

    LcmBus* bus;
    Handler handler;
    lcm_subscription_t* lcm_subscription = nullptr;
    std::weak_ptr<Subscription> self;
  };
  struct Message {
    std::weak_ptr<Subscription> subscription;
    std::string channel;
    std::vector<uint8_t> bytes;
  };
  using Subscriptions = std::map<std::string, std::shared_ptr<Subscription>>;

  void Add(Subscriptions* all, const std::string& name, const std::string& regex, Handler handler) {
    if (const auto found = all->find(name); found != all->end()) {
      found->second->handler = std::move(handler);
      return;
    }
    const bool first = exact_.empty() && prefixes_.empty() && !receiving_;
    const bool udp = url_.provider == "udpm";
    const std::set<int> before = first && udp ? SocketsOnPort(url_.port) : std::set<int>();
    auto subscription = std::make_shared<Subscription>(this, std::move(handler));
    subscription->self = subscription;
    subscription->lcm_subscription =
        lcm_subscribe(lcm_, regex.c_str(), &OnMessage, subscription.get());
    if (subscription->lcm_subscription != nullptr) {
      // LCM's own queue holds 30 by default; ours counts what it drops.
      lcm_subscription_set_queue_capacity(subscription->lcm_subscription,
                                          static_cast<int>(kBusQueueDepth));
    }
    (*all)[name] = std::move(subscription);
    if (first) {
      receiving_ = true;
      if (udp) FindSocket(before);
    }
    UpdateFilter();
  }

  void FindSocket(const std::set<int>& before) {
    for (const int fd : SocketsOnPort(url_.port)) {
      if (!before.contains(fd)) socket_ = fd;
    }
  }

  /// The kernel's filter follows the subscriptions; a prefix needs everything.
  void UpdateFilter() {
    if (socket_ < 0) return;
    std::vector<sock_filter> program;
    if (prefixes_.empty()) {
      std::vector<std::string> channels;
      for (const auto& [channel, subscription] : exact_) channels.push_back(channel);
      program = BuildChannelFilter(std::move(channels));
    }
    AttachFilter(socket_, program);
  }

  /// One wake-up for all that has arrived.
  void WaitAndDrain(int timeout_ms) {
    if (!receiving_) {
      poll(nullptr, 0, timeout_ms);
      return;
    }
    pollfd ready = {lcm_get_fileno(lcm_), POLLIN, 0};
    if (poll(&ready, 1, timeout_ms) <= 0) return;
    // lcm_handle never blocks while the descriptor is readable: one byte stands for the whole
    // queue.
    for (size_t i = 0; i < 2 * kBusQueueDepth && (ready.revents & POLLIN) != 0; ++i) {
      if (lcm_handle(lcm_) != 0) return;
      ready.revents = 0;
      poll(&ready, 1, 0);
    }
  }

  static void OnMessage(const lcm_recv_buf_t* buffer, const char* channel, void* user) {
    auto* subscription = static_cast<Subscription*>(user);
    LcmBus* bus = subscription->bus;
    if (bus->queue_.size() >= kBusQueueDepth) {
      ++bus->overflows_;
      return;
    }
    const auto* bytes = static_cast<const uint8_t*>(buffer->data);
    bus->queue_.push_back({subscription->self, channel, {bytes, bytes + buffer->data_size}});
  }

  lcm_t* lcm_;
  LcmUrl url_;
  Subscriptions exact_, prefixes_;
  std::deque<Message> queue_;
  bool receiving_ = false;
  int socket_ = -1;
  int64_t overflows_ = 0;
};

}  // namespace

Result<std::unique_ptr<Bus>> OpenLcmBus(const std::string& url) {
  Result<LcmUrl> resolved = ResolveLcmUrl(url);
  if (!resolved) return tl::unexpected<Error>(resolved.error());
  if (Result<void> route = CheckMulticastRoute(*resolved); !route) {
    return tl::unexpected<Error>(route.error());
  }
  lcm_t* lcm = lcm_create(resolved->url.c_str());
  if (lcm == nullptr) return Fail("LCM cannot open '" + resolved->url + "'");
  return std::make_unique<LcmBus>(lcm, *std::move(resolved));
}

}  // namespace morphbus::bridge
