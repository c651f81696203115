#include "bridge/bus/lcm_bus.h"

#include <lcm/lcm.h>
#include <poll.h>
#include <time.h>

#include <cstring>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "bridge/bus/lcm_datagrams.h"
#include "bridge/bus/lcm_url.h"
#include "bridge/bus/subscriptions.h"
#include "bridge/bus/udpm_sender.h"
#include "bridge/bus/udpm_socket.h"

namespace morphbus::bridge {
namespace {

/// LCM takes subscriptions as regular expressions.
std::string EscapeForRegex(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (std::strchr("\\^$.|?*+()[]{}", c) != nullptr) escaped += '\\';
    escaped += c;
  }
  return escaped;
}

/// Sends through LCM; the two kinds of bus below differ in how they receive.
class SendingBus : public Bus {
 public:
  SendingBus(lcm_t* lcm, LcmUrl url) : lcm_(lcm), url_(std::move(url)) {
    if (url_.provider == "udpm") sender_ = UdpmSender::Open(url_);
  }
  ~SendingBus() override { lcm_destroy(lcm_); }
  SendingBus(const SendingBus&) = delete;
  SendingBus& operator=(const SendingBus&) = delete;

  void Publish(const std::string& channel, const uint8_t* data, size_t size) override {
    // A failure (no buffer space) is a lost message like any other: the receivers' ledgers show it.
    if (sender_ != nullptr && sender_->Send(channel, data, size)) return;
    lcm_publish(lcm_, channel.c_str(), data, static_cast<unsigned>(size));
  }
  void Receive(const Channels& channels, Handler handler) override {
    subscriptions_.Add(channels, std::move(handler));
    if (channels.by == Channels::By::kName) interests_[channels.name] = channels.interest;
    ChangeOrWait();
  }
  void Unsubscribe(const std::string& channel) override {
    interests_.erase(channel);
    if (subscriptions_.Remove(channel)) ChangeOrWait();
  }
  void BatchSubscriptions(bool hold) override {
    // Many subscriptions at once are made known to LCM and the kernel together, at the end of the
    // batch.
    held_ = hold;
    if (!hold && std::exchange(changed_, false)) Changed();
  }

 protected:
  /// Called when the subscriptions have changed: what is received must follow.
  virtual void Changed() = 0;

  // LCM's handle, which this bus owns, and the URL that it was opened on.
  lcm_t* lcm_;
  LcmUrl url_;
  /// Sends what it can; null where only LCM can.
  std::unique_ptr<UdpmSender> sender_;
  Subscriptions subscriptions_;
  /// What is needed of the channels in it, by name.
  std::map<std::string, Interest> interests_;

 private:
  void ChangeOrWait() {
    changed_ = held_;
    if (!held_) Changed();
  }

  // Whether changes wait for the end of a batch, and whether one waits.
  bool held_ = false, changed_ = false;
};

/// UDP multicast, LCM's default. Messages that need not wake the process have a socket of their
/// own, which it never waits for.
class UdpmBus : public SendingBus {
 public:
  using SendingBus::SendingBus;

  void WakeForAny(bool any) override { wake_for_any_ = any; }

  int HandleFor(int64_t timeout_us) override {
    if (waking_ == nullptr && quiet_ == nullptr) {
      const timespec timeout = {timeout_us / 1'000'000, timeout_us % 1'000'000 * 1000};
      ppoll(nullptr, 0, &timeout, nullptr);
      return 0;
    }
    // Datagrams become messages, and each message goes to the subscribers of its channel.
    int count = 0;
    const LcmDatagrams::Sink dispatch = [&](std::string_view channel, const uint8_t* data,
                                            size_t size) {
      count += subscriptions_.Dispatch(channel, data, size);
    };
    const UdpmSocket::Sink take = [&](const Datagram& datagram) {
      datagrams_.Take(datagram.data, datagram.size, dispatch);
    };
    const bool both = wake_for_any_ && quiet_ != nullptr;
    if (waking_ == nullptr || both) {
      UdpmSocket::Wait({waking_.get(), both ? quiet_.get() : nullptr}, timeout_us);
    } else {
      waking_->Await(timeout_us);
    }
    // Whatever was sent before the message that woke us is there by now, since the kernel delivers
    // on this machine before sending returns; so what is quiet goes first.
    if (quiet_ != nullptr) quiet_->Take(kBusQueueDepth, take);
    if (waking_ != nullptr) waking_->Take(kBusQueueDepth, take);
    return count;
  }

  [[nodiscard]] BusLosses losses() const override {
    BusLosses losses;
    losses.fragments = datagrams_.fragments();
    if (waking_ != nullptr) losses.queue_overflows = waking_->drops();
    for (const UdpmSocket* socket : {waking_.get(), quiet_.get()}) {
      if (socket != nullptr) losses.refused_filters += socket->refused_filters();
    }
    return losses;
  }

 private:
  /// The socket, opened if need be; null if the system has none left.
  UdpmSocket* Open(std::unique_ptr<UdpmSocket>* socket) {
    // LCM has opened its own socket on this group, so this fails only when descriptors run out.
    if (*socket == nullptr) {
      if (Result<std::unique_ptr<UdpmSocket>> opened = UdpmSocket::Open(url_)) {
        *socket = *std::move(opened);
      }
    }
    return socket->get();
  }

  void Changed() override {
    // Modules name the channels they need, and the kernel keeps all others from waking them. A
    // prefix (the logger) needs everything.
    if (!subscriptions_.prefixes().empty()) {
      Silence();
      if (UdpmSocket* socket = Open(&waking_)) socket->PassEverything();
      return;
    }
    std::vector<ChannelInterest> all, waking, quiet;
    for (const auto& [channel, interest] : interests_) {
      all.push_back({channel, interest});
      (interest.wakes ? waking : quiet).push_back({channel, interest});
    }
    if (Open(&waking_) == nullptr) return;
    // Two sockets only if both filters hold; else messages would come twice, or not at all.
    const ChannelPattern pattern = {subscriptions_.pattern().prefix,
                                    subscriptions_.pattern().suffix};
    const bool any_quiet = !quiet.empty() || !pattern.prefix.empty();
    if (any_quiet && Open(&quiet_) != nullptr && quiet_->SetChannels(quiet, pattern) &&
        waking_->SetChannels(waking)) {
      return;
    }
    Silence();
    waking_->SetChannels(all, pattern);
  }

  /// Nothing comes by the second socket any more. It stays open: it may be at work up the stack.
  void Silence() {
    if (quiet_ != nullptr) quiet_->SetChannels({});
  }

  std::unique_ptr<UdpmSocket> waking_, quiet_;
  bool wake_for_any_ = false;
  LcmDatagrams datagrams_;
};

/// Every other provider, through LCM's own receiver.
class ProviderBus : public SendingBus {
 public:
  using SendingBus::SendingBus;

  int HandleFor(int64_t timeout_us) override {
    // Rounded up: waking a moment too early would only spin.
    const int timeout_ms = static_cast<int>((timeout_us + 999) / 1000);
    if (subscription_ == nullptr) {
      poll(nullptr, 0, timeout_ms);
      return 0;
    }
    // Waits for the first message, then takes all that are there.
    count_ = 0;
    pollfd ready = {lcm_get_fileno(lcm_), POLLIN, 0};
    if (poll(&ready, 1, timeout_ms) <= 0) return 0;
    // lcm_handle never blocks while the descriptor is readable.
    for (size_t i = 0; i < kBusQueueDepth && (ready.revents & POLLIN) != 0; ++i) {
      if (lcm_handle(lcm_) != 0) break;
      ready.revents = 0;
      poll(&ready, 1, 0);
    }
    return count_;
  }

 private:
  void Changed() override {
    // One subscription for all channels keeps the order of arrival across them.
    if (subscription_ != nullptr) lcm_unsubscribe(lcm_, subscription_);
    subscription_ = nullptr;
    std::string regex;
    for (const auto& [channel, handler] : subscriptions_.exact()) {
      regex += "|" + EscapeForRegex(channel);
    }
    for (const auto& [prefix, handler] : subscriptions_.prefixes()) {
      regex += "|" + EscapeForRegex(prefix) + ".*";
    }
    if (const Subscriptions::Pattern& pattern = subscriptions_.pattern(); pattern.handler) {
      regex += "|" + EscapeForRegex(pattern.prefix) + ".*" + EscapeForRegex(pattern.suffix);
    }
    if (regex.empty()) return;
    regex = "(" + regex.substr(1) + ")";
    subscription_ = lcm_subscribe(lcm_, regex.c_str(), &OnMessage, this);
    // LCM's own queue holds 30 by default.
    if (subscription_ != nullptr) {
      lcm_subscription_set_queue_capacity(subscription_, static_cast<int>(kBusQueueDepth));
    }
  }

  /// LCM calls this from lcm_handle, once for each message.
  static void OnMessage(const lcm_recv_buf_t* buffer, const char* channel, void* user) {
    auto* bus = static_cast<ProviderBus*>(user);
    bus->count_ += bus->subscriptions_.Dispatch(channel, static_cast<const uint8_t*>(buffer->data),
                                                buffer->data_size);
  }

  lcm_subscription_t* subscription_ = nullptr;
  int count_ = 0;
};

}  // namespace

Result<std::unique_ptr<Bus>> OpenLcmBus(const std::string& url) {
  Result<LcmUrl> resolved = ResolveLcmUrl(url);
  if (!resolved) return tl::unexpected<Error>(resolved.error());
  // Without a route LCM would send into nothing and not say so.
  if (Result<void> route = CheckMulticastRoute(*resolved); !route) {
    return tl::unexpected<Error>(route.error());
  }
  // From here on the bus owns LCM's handle.
  lcm_t* lcm = lcm_create(resolved->url.c_str());
  if (lcm == nullptr) return Fail("LCM cannot open '" + resolved->url + "'");
  if (resolved->provider == "udpm") return std::make_unique<UdpmBus>(lcm, *std::move(resolved));
  return std::make_unique<ProviderBus>(lcm, *std::move(resolved));
}

Result<std::unique_ptr<Bus>> OpenRunBus(const std::string& url) {
  return ResolveLcmUrl(url).and_then(CheckCarriesRuns).and_then([&] { return OpenLcmBus(url); });
}

}  // namespace morphbus::bridge
