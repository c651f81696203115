#pragma once
// LCM URLs as LCM users know them, checked before LCM sees them: LCM itself prints to stderr and
// goes on.

#include <netinet/in.h>

#include <cstdint>
#include <string>

#include "compiler/base/result.h"

namespace morphbus::bridge {

/// LCM's own default, with our receive buffer.
inline constexpr const char* kDefaultLcmUrl =
    "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304";

/// The command that lets multicast reach this machine by its loopback; without it LCM hears
/// nothing.
inline constexpr const char* kMulticastRouteCommand =
    "sudo ip link set lo up multicast on && sudo ip route add 224.0.0.0/4 dev lo";

/// An LCM URL, checked and taken apart as far as we need it.
struct LcmUrl {
  std::string url;               ///< To hand to LCM, recv_buf_size added to udpm if it was absent.
  std::string provider;          ///< "udpm", "file", "tcpq", "mpudpm" or "memq".
  uint32_t group = 0;            ///< udpm, mpudpm: IPv4 address of the group, host byte order.
  uint16_t port = 0;             ///< udpm, mpudpm: UDP port.
  int receive_buffer = 4194304;  ///< udpm: bytes asked of the kernel.
  int ttl = 0;                   ///< udpm: networks that datagrams may cross; 0: none.
};

/// The URL to use: `given`, else $LCM_DEFAULT_URL, else the default. It is checked: provider known,
/// group within 224.0.0.0/4, port 1..65535, options known, numbers in range. Fails in one sentence
/// that quotes the URL and says what is wrong with it.
Result<LcmUrl> ResolveLcmUrl(const std::string& given);

/// Fails, in one sentence, for a provider that cannot carry a run: LCM's files, TCP and memory
/// queues bring messages to too few, in another order, or not at all; runs need UDP multicast.
Result<void> CheckCarriesRuns(const LcmUrl& url);

/// The address of a group, given in host byte order, as system calls take it.
sockaddr_in SocketAddress(uint32_t group, uint16_t port);

/// The interface by which datagrams to `group` (host byte order) leave, by the kernel's main table
/// of routes: the longest prefix wins, then the lowest metric. Empty if there is none. (The address
/// that a socket gets would not tell: to multicast by the loopback the kernel gives none.)
std::string MulticastInterface(uint32_t group);

/// Fails with one sentence that names the mending command if multicast to the group has no route
/// here.
/// Other providers than udpm and mpudpm need no route.
Result<void> CheckMulticastRoute(const LcmUrl& url);

}  // namespace morphbus::bridge
