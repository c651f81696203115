#pragma once
// The sending side of LCM's UDP multicast, where the group is on this machine's loopback.

#include <array>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "bridge/bus/lcm_url.h"
#include "bridge/bus/udpm_sources.h"

namespace morphbus::bridge {

/// Sends messages as LCM does, each from the loopback's address that is its channel's
/// (bridge/bus/udpm_sources.h). Closes its socket at the end.
class UdpmSender {
 public:
  /// Null if the group is not on the loopback, or the system has no socket left: then LCM sends.
  static std::unique_ptr<UdpmSender> Open(const LcmUrl& url);
  ~UdpmSender();
  UdpmSender(const UdpmSender&) = delete;
  UdpmSender& operator=(const UdpmSender&) = delete;

  /// Sends a message that fits into one datagram; false if it does not, or the system refuses.
  bool Send(std::string_view channel, const uint8_t* data, size_t size);

 private:
  UdpmSender(int fd, const LcmUrl& url) : fd_(fd), to_(SocketAddress(url.group, url.port)) {}

  // The socket, and where it sends to.
  int fd_;
  sockaddr_in to_;
  /// LCM's number of the next datagram from each address, since listeners count gaps by address.
  std::array<uint32_t, kNumSources> sequences_ = {};
};

}  // namespace morphbus::bridge
