#include "bridge/bus/lcm_tap.h"

#include <lcm/lcm.h>
#include <poll.h>

#include <utility>

#include "bridge/bus/lcm_datagrams.h"
#include "bridge/bus/lcm_fragments.h"
#include "bridge/bus/lcm_senders.h"
#include "bridge/bus/lcm_url.h"
#include "bridge/bus/udpm_socket.h"
#include "compiler/base/big_endian.h"

namespace morphbus::bridge {
namespace {

// Messages that one call of Take hands over, about, so that its caller gets to do other things.
constexpr size_t kMostAtOnce = 4096;

/// UDP multicast, by a socket of its own without LCM's thread.
class UdpmTap : public LcmTap {
 public:
  explicit UdpmTap(std::unique_ptr<UdpmSocket> socket) : socket_(std::move(socket)) {
    // The kernel's times of arrival: those of a process that is busy come late.
    socket_->TellArrivals();
    // The spy wants all channels, other programs' too.
    socket_->PassEverything();
  }

  void Take(const Sink& sink) override {
    socket_->Take(kMostAtOnce, [&](const Datagram& datagram) { TakeOne(datagram, sink); });
  }
  [[nodiscard]] int fd() const override { return socket_->fd(); }
  [[nodiscard]] TapLosses losses() const override {
    return {senders_.lost(), socket_->drops(), fragments_.given_up(), datagrams_.bad()};
  }

 private:
  /// A datagram is a message, a part of one, or no business of LCM's.
  void TakeOne(const Datagram& datagram, const Sink& sink) {
    // What it is, and which one; zeros of what is too short to be LCM's.
    const bool whole = datagram.size >= 8;
    const uint32_t magic = whole ? LoadBigEndian<uint32_t>(datagram.data) : 0;
    const uint32_t sequence = whole ? LoadBigEndian<uint32_t>(datagram.data + 4) : 0;
    const auto take = [&](std::string_view channel, const uint8_t* data, size_t size) {
      sink({channel, data, size, datagram.arrival_ns});
    };
    // Both kinds count up one number for each datagram of a sender, by which gaps are seen.
    if (magic == kLcmShortMagic || magic == kLcmFragmentMagic) {
      senders_.Take(datagram.sender, sequence);
    }
    if (magic == kLcmFragmentMagic) {
      fragments_.Take(datagram.sender, datagram.data, datagram.size, take);
    } else {
      datagrams_.Take(datagram.data, datagram.size, take);
    }
  }

  std::unique_ptr<UdpmSocket> socket_;
  LcmDatagrams datagrams_;
  LcmFragments fragments_;
  LcmSenders senders_;
};

/// Every other provider, through LCM's own receiver.
class ProviderTap : public LcmTap {
 public:
  explicit ProviderTap(lcm_t* lcm) : lcm_(lcm) {
    subscription_ = lcm_subscribe(lcm_, ".*", &OnMessage, this);
    if (subscription_ != nullptr) {
      // LCM keeps 30 messages by itself and drops older ones.
      lcm_subscription_set_queue_capacity(subscription_, static_cast<int>(kMostAtOnce));
    }
  }
  ~ProviderTap() override { lcm_destroy(lcm_); }
  ProviderTap(const ProviderTap&) = delete;
  ProviderTap& operator=(const ProviderTap&) = delete;

  void Take(const Sink& sink) override {
    // LCM's callback has one pointer, which is the tap itself; so the sink of this call is kept in
    // it.
    sink_ = &sink;
    pollfd ready = {fd(), POLLIN, 0};
    // lcm_handle never blocks while the descriptor is readable.
    for (size_t i = 0; i < kMostAtOnce && poll(&ready, 1, 0) > 0; ++i) {
      if ((ready.revents & POLLIN) == 0 || lcm_handle(lcm_) != 0) break;
    }
    sink_ = nullptr;
  }
  [[nodiscard]] int fd() const override { return lcm_get_fileno(lcm_); }
  [[nodiscard]] TapLosses losses() const override { return {}; }

 private:
  /// LCM calls this from lcm_handle, once for each message.
  static void OnMessage(const lcm_recv_buf_t* buffer, const char* channel, void* user) {
    const auto* tap = static_cast<ProviderTap*>(user);
    (*tap->sink_)({channel, static_cast<const uint8_t*>(buffer->data), buffer->data_size,
                   // LCM tells microseconds.
                   buffer->recv_utime * 1000});
  }

  lcm_t* lcm_;
  lcm_subscription_t* subscription_ = nullptr;
  const Sink* sink_ = nullptr;  ///< Of the call of Take that is running.
};

}  // namespace

Result<std::unique_ptr<LcmTap>> LcmTap::Open(const std::string& url) {
  Result<LcmUrl> resolved = ResolveLcmUrl(url);
  if (!resolved) return tl::unexpected<Error>(resolved.error());
  // Without a route nothing would ever be heard, and the silence would look like an empty bus.
  if (Result<void> route = CheckMulticastRoute(*resolved); !route) {
    return tl::unexpected<Error>(route.error());
  }
  if (resolved->provider == "udpm") {
    Result<std::unique_ptr<UdpmSocket>> socket = UdpmSocket::Open(*resolved);
    if (!socket) return tl::unexpected<Error>(socket.error());
    return std::make_unique<UdpmTap>(*std::move(socket));
  }
  lcm_t* lcm = lcm_create(resolved->url.c_str());
  if (lcm == nullptr) return Fail("LCM cannot open '" + resolved->url + "'");
  return std::make_unique<ProviderTap>(lcm);
}

}  // namespace morphbus::bridge
