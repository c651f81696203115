#include "bridge/bus/lcm_url.h"

#include <arpa/inet.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "compiler/base/quantity.h"

namespace morphbus::bridge {
namespace {

constexpr std::string_view kUdpExample = "udpm://239.255.76.67:7667?ttl=0";

/// A URL taken apart; the views point into it.
struct Parts {
  std::string_view provider, network;
  std::vector<std::pair<std::string_view, std::string_view>> options;  ///< Name and value.
};

/// All refusals quote the URL and say in the same breath what is wrong with it.
tl::unexpected<Error> Bad(const std::string& url, const std::string& why) {
  return Fail("the LCM URL '" + url + "' " + why);
}

/// The whole text as a decimal number; -1 if it is none.
int64_t ToNumber(std::string_view text) { return ReadNumber<int64_t>(text).value_or(-1); }

/// Takes PROVIDER://NETWORK?NAME=VALUE&... apart; the names are checked later.
Result<Parts> Split(const std::string& url) {
  const std::string_view text = url;
  const size_t scheme = text.find("://");
  if (scheme == std::string_view::npos) {
    return Bad(url, "has no provider; write it like " + std::string(kUdpExample));
  }
  Parts parts;
  // What stands between "://" and "?" is the network, in whatever way the provider writes it.
  parts.provider = text.substr(0, scheme);
  std::string_view rest = text.substr(scheme + 3);
  const size_t mark = rest.find('?');
  parts.network = rest.substr(0, mark);
  rest = mark == std::string_view::npos ? std::string_view() : rest.substr(mark + 1);
  // Options, separated by "&".
  while (!rest.empty()) {
    const std::string_view one = rest.substr(0, rest.find('&'));
    rest = one.size() == rest.size() ? std::string_view() : rest.substr(one.size() + 1);
    const size_t equals = one.find('=');
    if (equals == std::string_view::npos || equals == 0) {
      return Bad(url, "has the option '" + std::string(one) + "', which is not written name=value");
    }
    parts.options.emplace_back(one.substr(0, equals), one.substr(equals + 1));
  }
  return parts;
}

/// Reads "239.255.76.67:7667"; both halves may be left out, as in LCM.
Result<void> ReadGroup(const std::string& url, std::string_view network, LcmUrl* out) {
  // LCM's defaults, where a half is left out.
  out->group = 0xefff4c43;  // 239.255.76.67
  out->port = 7667;
  const size_t colon = network.find(':');
  const std::string address(network.substr(0, colon));
  if (!address.empty()) {
    in_addr group = {};
    if (inet_pton(AF_INET, address.c_str(), &group) != 1) {
      return Bad(url, "has the group '" + address + "', which is not an IPv4 address");
    }
    out->group = ntohl(group.s_addr);
  }
  // Multicast addresses begin with the bits 1110.
  if (out->group >> 28 != 0xe) {
    return Bad(url, "has the group " + address +
                        ", which is no multicast address (224.0.0.0 to 239.255.255.255)");
  }
  if (colon == std::string_view::npos) return {};
  const int64_t port = ToNumber(network.substr(colon + 1));
  if (port < 1 || port > 65535) {
    return Bad(url, "has the port '" + std::string(network.substr(colon + 1)) +
                        "', which is not a number from 1 to 65535");
  }
  out->port = static_cast<uint16_t>(port);
  return {};
}

/// An option that LCM knows, and the range of its value.
struct OptionRow {
  std::string_view key;
  int64_t lowest, highest;
};

/// LCM prints what it does not know and goes on: here that is an error. Yields the receive buffer
/// and the time to live if the URL sets them.
Result<void> CheckUdpOptions(const std::string& url, const Parts& parts, std::optional<int>* buffer,
                             int* ttl) {
  // "transmit_only" and "nports" are mpudpm's and newer LCM's; harmless to the others.
  constexpr std::array<OptionRow, 4> kKnown = {{{"ttl", 0, 255},
                                                {"recv_buf_size", 0, 1 << 30},
                                                {"transmit_only", 0, 1},
                                                {"nports", 1, 60000}}};
  for (const auto& [key, value] : parts.options) {
    const auto known = std::find_if(kKnown.begin(), kKnown.end(),
                                    [key = key](const OptionRow& row) { return row.key == key; });
    if (known == kKnown.end()) {
      return Bad(url, "has the option '" + std::string(key) +
                          "', which LCM does not know; ttl and recv_buf_size exist");
    }
    // LCM reads booleans of transmit_only so.
    const bool truth = value == "true" || value == "false";
    const int64_t number = truth ? value == "true" : ToNumber(value);
    if (number < known->lowest || number > known->highest) {
      return Bad(url, "has " + std::string(key) + "=" + std::string(value) +
                          ", which is not a number from " + std::to_string(known->lowest) + " to " +
                          std::to_string(known->highest));
    }
    if (key == "recv_buf_size") *buffer = static_cast<int>(number);
    if (key == "ttl") *ttl = static_cast<int>(number);
  }
  return {};
}

}  // namespace

Result<LcmUrl> ResolveLcmUrl(const std::string& given) {
  std::string url = given;
  if (url.empty()) {
    // NOLINTNEXTLINE(concurrency-mt-unsafe): read before any thread exists.
    const char* from_environment = std::getenv("LCM_DEFAULT_URL");
    url = from_environment != nullptr && *from_environment != '\0' ? from_environment
                                                                   : kDefaultLcmUrl;
  }
  // Every provider's URL has the same form; only those with a network are read further.
  const Result<Parts> parts = Split(url);
  if (!parts) return tl::unexpected<Error>(parts.error());
  LcmUrl out;
  out.provider = parts->provider;
  out.url = url;
  // UDP multicast: group, port and options are checked, and the receive buffer is made large.
  if (out.provider == "udpm" || out.provider == "mpudpm") {
    std::optional<int> buffer;
    const Result<void> checked = ReadGroup(url, parts->network, &out).and_then([&] {
      return CheckUdpOptions(url, *parts, &buffer, &out.ttl);
    });
    if (!checked) return tl::unexpected<Error>(checked.error());
    // LCM's default buffer holds 166 datagrams of ours: a stalled receiver would lose messages.
    out.receive_buffer = buffer.value_or(out.receive_buffer);
    if (buffer) return out;
    if (!url.ends_with('?')) out.url += parts->options.empty() ? "?" : "&";
    out.url += "recv_buf_size=4194304";
    return out;
  }
  // LCM reads these itself; they have no group.
  if (out.provider == "file" || out.provider == "tcpq" || out.provider == "memq") return out;
  return Bad(url, "names the provider '" + out.provider +
                      "', which LCM does not have; write it like " + std::string(kUdpExample));
}

Result<void> CheckCarriesRuns(const LcmUrl& url) {
  if (url.provider == "udpm" || url.provider == "mpudpm") return {};
  return Bad(url.url, "names the provider '" + url.provider +
                          "', which cannot carry a run: write it like " + std::string(kUdpExample) +
                          ", or run all in one process (--inproc)");
}

sockaddr_in SocketAddress(uint32_t group, uint16_t port) {
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(group);
  address.sin_port = htons(port);
  return address;
}

std::string MulticastInterface(uint32_t group) {
  std::ifstream table("/proc/net/route");
  std::string line;
  std::string best;
  uint32_t best_mask = 0;
  unsigned best_metric = 0;
  while (std::getline(table, line)) {
    // Addresses stand there in network byte order, as hexadecimal numbers of this machine.
    std::array<char, IF_NAMESIZE> name = {};
    unsigned destination = 0, flags = 0, metric = 0, mask = 0;
    // Columns of proc(5), net/route: interface, destination, gateway, flags, references, uses,
    // metric, mask. The heading does not fit and is passed over.
    constexpr const char* kColumns = "%15s %x %*x %x %*d %*d %u %x";
    if (std::sscanf(line.c_str(), kColumns, name.data(), &destination, &flags, &metric, &mask) != 5)
      continue;
    constexpr unsigned kUp = 1;
    if ((flags & kUp) == 0 || (htonl(group) & mask) != destination) continue;
    // The longest mask wins, then the lowest metric, as in the kernel.
    const bool better = best.empty() || ntohl(mask) > best_mask ||
                        (ntohl(mask) == best_mask && metric < best_metric);
    if (!better) continue;
    best = name.data();
    best_mask = ntohl(mask);
    best_metric = metric;
  }
  return best;
}

Result<void> CheckMulticastRoute(const LcmUrl& url) {
  if (url.provider != "udpm" && url.provider != "mpudpm") return {};
  // A socket that is connected to the group knows whether there is a way to it.
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return Fail(std::string("cannot open a UDP socket: ") + std::strerror(errno));
  const sockaddr_in address = SocketAddress(url.group, url.port);
  // Connecting sends nothing: it only looks the route up.
  const int status = connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  const int error = errno;
  close(fd);
  if (status == 0) return {};
  std::array<char, INET_ADDRSTRLEN> text = {};
  inet_ntop(AF_INET, &address.sin_addr, text.data(), text.size());
  // The usual case gets the command that mends it.
  if (error == ENETUNREACH || error == EHOSTUNREACH) {
    return Fail(std::string("multicast to ") + text.data() +
                " has no route on this machine: run `" + kMulticastRouteCommand +
                "`, or give the run a network of its own with "
                "`morphbus run --isolate`");
  }
  return Fail(std::string("cannot reach the multicast group ") + text.data() + ": " +
              std::strerror(error));
}

}  // namespace morphbus::bridge
