#include "tools/machine/network.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <net/if.h>
#include <net/route.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>

#include "bridge/bus/udpm_sources.h"
#include "tools/base/descriptor.h"

namespace morphbus::tools {
namespace {

/// In one call, as the kernel demands of these files.
bool WriteProc(const char* path, const std::string& text) {
  const Descriptor file(open(path, O_WRONLY | O_CLOEXEC));
  return file.get() >= 0 &&
         write(file.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size());
}

/// A user namespace in which we keep our ids but may create networks.
Result<void> EnterUserNamespace() {
  // Read before the namespace is entered: in it they are unknown until mapped.
  const uid_t uid = geteuid();
  const gid_t gid = getegid();
  // Both namespaces are made in one call, so that the new user owns the new network.
  if (unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) {
    return Fail(
        fmt::format("--isolate needs user namespaces, which this system refuses ({}); as root: "
                    "sysctl kernel.unprivileged_userns_clone=1",
                    std::strerror(errno)));
  }
  WriteProc("/proc/self/setgroups", "deny");  // absent on old kernels
  // Our own ids stay what they are, so that files keep their owner.
  if (!WriteProc("/proc/self/uid_map", fmt::format("{} {} 1", uid, uid)) ||
      !WriteProc("/proc/self/gid_map", fmt::format("{} {} 1", gid, gid))) {
    return Fail(fmt::format("--isolate: cannot map the user ids: {}", std::strerror(errno)));
  }
  return {};
}

/// A new network has a loopback that is down, and no route for multicast.
Result<void> BringLoopbackUp() {
  // Any socket will do: the requests below are to the network, not to the socket.
  const Descriptor socket_fd(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  const auto failed = [](const char* what) {
    return Fail(fmt::format("--isolate: {}: {}", what, std::strerror(errno)));
  };
  ifreq request = {};
  std::strcpy(request.ifr_name, "lo");
  if (ioctl(socket_fd.get(), SIOCGIFFLAGS, &request) != 0) return failed("no loopback");
  // Multicast must be asked for: a loopback has none of itself.
  request.ifr_flags = static_cast<decltype(request.ifr_flags)>(request.ifr_flags | IFF_UP |
                                                               IFF_RUNNING | IFF_MULTICAST);
  if (ioctl(socket_fd.get(), SIOCSIFFLAGS, &request) != 0) {
    return failed("cannot bring the loopback up");
  }
  // The kernel takes addresses of any family in a sockaddr.
  const auto address = [](const char* text) {
    sockaddr_in in = {};
    in.sin_family = AF_INET;
    inet_pton(AF_INET, text, &in.sin_addr);
    sockaddr out = {};
    std::memcpy(&out, &in, sizeof out);
    return out;
  };
  // All multicast, 224.0.0.0/4, goes to the loopback: LCM needs no more.
  rtentry route = {};
  std::string device = "lo";
  route.rt_dst = address("224.0.0.0");
  route.rt_genmask = address("240.0.0.0");
  route.rt_flags = RTF_UP;
  route.rt_dev = device.data();
  if (ioctl(socket_fd.get(), SIOCADDRT, &route) != 0 && errno != EEXIST) {
    return failed("cannot route multicast");
  }
  // A receiver may list as many senders as there are, and those of other programs
  // (bridge/bus/udpm_sources.h). Without this it costs time and nothing else.
  WriteProc("/proc/sys/net/ipv4/igmp_max_msf", std::to_string(bridge::kNumSources + 1));
  return {};
}

}  // namespace

Result<void> EnterPrivateNetwork() {
  // Root keeps its rights over files by going without a user namespace.
  if (geteuid() != 0 || unshare(CLONE_NEWNET) != 0) {
    if (Result<void> entered = EnterUserNamespace(); !entered) return entered;
  }
  return BringLoopbackUp();
}

Result<void> JoinNetworkOf(pid_t pid) {
  namespace fs = std::filesystem;
  // The user namespace first: it gives the right to enter the other.
  const std::string theirs = fmt::format("/proc/{}/ns/", pid);
  for (const auto& [name, flag] :
       {std::pair("user", CLONE_NEWUSER), std::pair("net", CLONE_NEWNET)}) {
    std::error_code ignored;
    const fs::path their_link = fs::read_symlink(theirs + name, ignored);
    // A namespace that both share cannot be entered again, and need not be.
    if (their_link == fs::read_symlink(std::string("/proc/self/ns/") + name, ignored)) continue;
    const Descriptor ns(open((theirs + name).c_str(), O_RDONLY | O_CLOEXEC));
    if (ns.get() < 0 || setns(ns.get(), flag) != 0) {
      return Fail(fmt::format("cannot join the private network of process {}: {}", pid,
                              std::strerror(errno)));
    }
  }
  return {};
}

Result<void> JoinNetworkOf(const RunEntry& run) {
  return run.isolated ? JoinNetworkOf(run.pid) : Result<void>();
}

}  // namespace morphbus::tools
