#include "tools/machine/machine_checks.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/timex.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <thread>
#include <utility>

#include "bridge/bus/channel_filter.h"
#include "bridge/bus/udpm_socket.h"
#include "bridge/wire/channels.h"
#include "sim/arithmetic.h"
#include "tools/base/descriptor.h"
#include "tools/machine/machine_findings.h"

namespace morphbus::tools {
namespace {

/// A typical message, bytes; and how many are sent to see how many are kept.
constexpr size_t kMessageBytes = 200;
constexpr int kBurst = 2 * kNeededMessages;

/// The first line of a small file such as those under /proc/sys; empty if there is none.
std::string FirstLine(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

/// A UDP socket.
Descriptor Udp() { return Descriptor(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)); }

/// The flags (IFF_…) of an interface; 0 if there is none of that name.
unsigned FlagsOf(const std::string& interface) {
  const Descriptor udp = Udp();
  ifreq request = {};
  interface.copy(request.ifr_name, IF_NAMESIZE - 1);
  if (ioctl(udp.get(), SIOCGIFFLAGS, &request) != 0) return 0;
  return static_cast<uint16_t>(request.ifr_flags);
}

/// Whether the kernel knows where to send what is for the group.
Finding CheckRoute(const bridge::LcmUrl& url) {
  Finding finding{"route", Health::kGood, "multicast to the group has a route", "", {}};
  if (const Result<void> route = bridge::CheckMulticastRoute(url); !route) {
    finding.health = Health::kBroken;
    finding.text = "multicast to the group has no route on this machine";
    finding.mend = bridge::kMulticastRouteCommand;
  }
  return finding;
}

/// Whether messages leave by an interface that carries multicast, and towards those that the URL's
/// time to live means.
Finding CheckInterface(const bridge::LcmUrl& url) {
  Finding finding{"interface", Health::kGood, "", "", {}};
  const std::string name = bridge::MulticastInterface(url.group);
  const unsigned flags = FlagsOf(name);
  const int ttl = url.ttl;
  const bool loopback = (flags & IFF_LOOPBACK) != 0;
  finding.figures = {{"ttl", ttl}};
  // The first thing that is wrong is told: what follows rests on it.
  if (name.empty()) {
    finding.health = Health::kBroken;
    finding.text = "no interface carries the group";
    finding.mend = bridge::kMulticastRouteCommand;
  } else if ((flags & IFF_MULTICAST) == 0) {
    finding.health = Health::kBroken;
    finding.text = fmt::format("messages leave by {}, on which multicast is off", name);
    finding.mend = fmt::format("sudo ip link set {} multicast on", name);
  } else if (ttl > 0 && loopback) {
    finding.health = Health::kWarning;
    finding.text = fmt::format(
        "messages leave by {} although ttl={} is meant for other machines, which hear nothing",
        name, ttl);
    finding.mend = "sudo ip route del 224.0.0.0/4 dev lo";
  } else {
    finding.text = fmt::format("messages leave by {}; ttl={}: {}", name, ttl,
                               ttl == 0 ? "they stay on this machine" : "other machines hear them");
  }
  return finding;
}

/// Sends kBurst messages to the group on a port that is nobody's, then counts those that are there.
Burst TryBurst(const bridge::LcmUrl& url) {
  Burst burst;
  const Descriptor receiver = Udp(), sender = Udp();
  // The kernel gives less than is asked for where net.core.rmem_max is lower, and says nothing;
  // what it tells is twice what it gives.
  burst.asked_bytes = url.receive_buffer;
  setsockopt(receiver.get(), SOL_SOCKET, SO_RCVBUF, &url.receive_buffer, sizeof(int));
  socklen_t size = sizeof burst.got_bytes;
  getsockopt(receiver.get(), SOL_SOCKET, SO_RCVBUF, &burst.got_bytes, &size);
  burst.got_bytes /= 2;
  // The kernel chooses a free port.
  sockaddr_in address = bridge::SocketAddress(INADDR_ANY, 0);
  size = sizeof address;
  ip_mreq membership = {};
  membership.imr_multiaddr.s_addr = htonl(url.group);
  if (bind(receiver.get(), reinterpret_cast<const sockaddr*>(&address), size) != 0 ||
      getsockname(receiver.get(), reinterpret_cast<sockaddr*>(&address), &size) != 0 ||
      setsockopt(receiver.get(), IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership)) {
    burst.error = fmt::format("cannot join the group: {}", std::strerror(errno));
    return burst;
  }
  // Nothing of it leaves this machine, whatever the URL says.
  const unsigned char ttl = 0;
  setsockopt(sender.get(), IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);
  address.sin_addr.s_addr = htonl(url.group);
  const std::array<char, kMessageBytes> message = {};
  for (int i = 0; i < kBurst; ++i) {
    if (sendto(sender.get(), message.data(), message.size(), 0,
               reinterpret_cast<const sockaddr*>(&address), sizeof address) < 0) {
      if (burst.sent == 0) burst.error = fmt::format("cannot send: {}", std::strerror(errno));
      break;
    }
    ++burst.sent;
  }
  // On the way through this machine's kernel a datagram is delivered before sendto returns.
  std::array<char, kMessageBytes> heard = {};
  while (recv(receiver.get(), heard.data(), heard.size(), MSG_DONTWAIT) > 0) ++burst.kept;
  return burst;
}

/// Whether anything of the burst arrived.
Finding CheckLoop(const Burst& burst) {
  Finding finding{"loop", Health::kGood, "what is sent to the group is heard here", "", {}};
  if (burst.kept > 0) return finding;
  finding.health = Health::kBroken;
  finding.text = burst.error.empty() ? "nothing that is sent to the group is heard here"
                                     : "nothing can be sent to the group: " + burst.error;
  // Only who set the firewall up knows how to open it; a network of one's own needs nobody.
  finding.mend = "morphbus run --isolate";
  return finding;
}

/// Whether the kernel takes a filter as large as those of the processes of large robots.
Finding CheckFilter() {
  // A process of so many modules listens to requests for each of them and to what each one says.
  constexpr int kManyModules = 1000;
  std::vector<bridge::ChannelInterest> channels;
  for (int i = 0; i < kManyModules; ++i) {
    for (const bridge::Topic topic : {bridge::Topic::kResend, bridge::Topic::kTransform}) {
      channels.push_back({bridge::Channel("doctor", fmt::format("m{}", i), topic), {}});
    }
  }
  const std::vector<sock_filter> program = bridge::BuildChannelFilter(channels);
  const Descriptor udp = Udp();
  const bool taken = bridge::AttachFilter(udp.get(), program);
  const std::string limit = FirstLine("/proc/sys/net/core/optmem_max");
  return JudgeFilter(std::strtoll(limit.c_str(), nullptr, 10), static_cast<int>(program.size()),
                     taken);
}

/// Whether --isolate can make a network; tried in a child process, which nothing else depends on.
Finding CheckNamespaces() {
  Finding finding{"namespaces", Health::kGood, "run --isolate can make a private network", "", {}};
  // Root needs no user namespace, and other users get one with the network in it.
  const pid_t child = fork();
  if (child == 0) {
    const bool able = (geteuid() == 0 && unshare(CLONE_NEWNET) == 0) ||
                      unshare(CLONE_NEWUSER | CLONE_NEWNET) == 0;
    _exit(able ? 0 : 1);
  }
  int status = 1;
  if (child > 0) waitpid(child, &status, 0);
  if (status == 0) return finding;
  finding.health = Health::kWarning;
  finding.text = "namespaces are refused, so run --isolate cannot make a private network";
  // Each system has a switch of its own; the first that is in the way is named.
  struct Switch {
    const char* key;
    const char* blocking;
    const char* open;
  };
  finding.mend = "sudo sysctl user.max_user_namespaces=15000";
  for (const auto& [key, blocking, open] :
       {Switch{"user.max_net_namespaces", "0", "15000"},
        Switch{"user.max_user_namespaces", "0", "15000"},
        Switch{"kernel.unprivileged_userns_clone", "0", "1"},
        Switch{"kernel.apparmor_restrict_unprivileged_userns", "1", "0"}}) {
    // A switch that this system does not have reads as nothing.
    std::string path = std::string("/proc/sys/") + key;
    std::replace(path.begin() + 10, path.end(), '.', '/');
    if (FirstLine(path) != blocking) continue;
    finding.mend = fmt::format("sudo sysctl {}={}", key, open);
    break;
  }
  return finding;
}

/// Whether the wall clock is set by others' clocks, which logs of several machines need.
Finding CheckClock() {
  // Asking changes nothing, and needs no rights.
  timex state = {};
  const int status = adjtimex(&state);
  return JudgeClock(status >= 0 && status != TIME_ERROR && (state.status & STA_UNSYNC) == 0);
}

/// How punctually this machine wakes a process that sleeps, which real time rests on.
Finding CheckTimer() {
  // Short naps, for a control tick is made of such waits.
  std::vector<double> late_ms(40);
  for (double& late : late_ms) {
    const auto due = std::chrono::steady_clock::now() + std::chrono::milliseconds(1);
    std::this_thread::sleep_until(due);
    late =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - due).count();
  }
  return JudgeTimer(std::move(late_ms));
}

}  // namespace

std::vector<Finding> CheckMachine(const bridge::LcmUrl& url, const std::string& url_from) {
  std::vector<Finding> findings;
  findings.push_back({"url", Health::kGood, fmt::format("{} ({})", url.url, url_from), "", {}});
  // Only multicast needs anything from the network here.
  if (url.provider == "udpm" || url.provider == "mpudpm") {
    const Finding route = CheckRoute(url);
    findings.push_back(route);
    findings.push_back(CheckInterface(url));
    // Without a route nothing can be sent to see what becomes of it.
    if (route.health == Health::kGood) {
      const Burst burst = TryBurst(url);
      findings.push_back(CheckLoop(burst));
      if (burst.kept > 0) findings.push_back(JudgeBuffer(burst));
    }
    findings.push_back(CheckFilter());
  }
  rlimit files = {};
  rlimit processes = {};
  getrlimit(RLIMIT_NOFILE, &files);
  getrlimit(RLIMIT_NPROC, &processes);
  findings.push_back(JudgeArithmetic(sim::ArithmeticFingerprint()));
  findings.push_back(JudgeFiles(files));
  findings.push_back(JudgeProcesses(processes));
  findings.push_back(CheckNamespaces());
  findings.push_back(CheckClock());
  findings.push_back(CheckTimer());
  return findings;
}

}  // namespace morphbus::tools
