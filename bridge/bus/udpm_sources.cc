#include "bridge/bus/udpm_sources.h"

#include <ifaddrs.h>

#include <algorithm>
#include <cstring>

namespace morphbus::bridge {

std::vector<in_addr> OtherSources() {
  std::vector<in_addr> sources = {{htonl(INADDR_ANY)}, {htonl(INADDR_LOOPBACK)}};
  ifaddrs* interfaces = nullptr;
  // Without the list the two general addresses remain: datagrams of other senders on this machine
  // are then refused.
  if (getifaddrs(&interfaces) != 0) return sources;
  for (const ifaddrs* i = interfaces; i != nullptr; i = i->ifa_next) {
    if (i->ifa_addr == nullptr || i->ifa_addr->sa_family != AF_INET) continue;
    // The kernel's general address is one of IPv4 here, at no sure alignment.
    sockaddr_in address = {};
    std::memcpy(&address, i->ifa_addr, sizeof address);
    // Interfaces may share an address, which is listed once.
    const bool known = std::any_of(sources.begin(), sources.end(), [&](const in_addr& source) {
      return source.s_addr == address.sin_addr.s_addr;
    });
    if (!known) sources.push_back(address.sin_addr);
  }
  freeifaddrs(interfaces);
  return sources;
}

}  // namespace morphbus::bridge
