#include "tools/network.h"

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
#include <cstdlib>
#include <cstring>
#include <filesystem>

namespace morphbus::tools {
namespace {

constexpr const char* kDefaultUrl = "udpm://239.255.76.67:7667?ttl=0";

/// A file descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

bool WriteProc(const char* path, const std::string& text) {
  const Descriptor file(open(path, O_WRONLY | O_CLOEXEC));
  return file.get() >= 0 &&
         write(file.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size());
}

/// A user namespace in which we keep our ids but may create networks.
Result<void> EnterUserNamespace() {
  const uid_t uid = geteuid();
  const gid_t gid = getegid();
  if (unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) {
    return Fail(fmt::format(
        "--isolate needs user namespaces, which this system refuses ({}); as root: "
        "sysctl kernel.unprivileged_userns_clone=1",
        std::strerror(errno)));
  }
  WriteProc("/proc/self/setgroups", "deny");  // absent on old kernels
  if (!WriteProc("/proc/self/uid_map", fmt::format("{} {} 1", uid, uid)) ||
      !WriteProc("/proc/self/gid_map", fmt::format("{} {} 1", gid, gid))) {
    return Fail(fmt::format("--isolate: cannot map the user ids: {}", std::strerror(errno)));
  }
  return {};
}

Result<void> BringLoopbackUp() {
  const Descriptor socket_fd(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  ifreq request = {};
  std::strcpy(request.ifr_name, "lo");
  if (ioctl(socket_fd.get(), SIOCGIFFLAGS, &request) != 0) {
    return Fail(fmt::format("--isolate: no loopback: {}", std::strerror(errno)));
  }
  request.ifr_flags = static_cast<decltype(request.ifr_flags)>(request.ifr_flags | IFF_UP |
                                                               IFF_RUNNING | IFF_MULTICAST);
  if (ioctl(socket_fd.get(), SIOCSIFFLAGS, &request) != 0) {
    return Fail(fmt::format("--isolate: cannot bring the loopback up: {}", std::strerror(errno)));
  }
  const auto address = [](const char* text) {
    sockaddr_in in = {};
    in.sin_family = AF_INET;
    inet_pton(AF_INET, text, &in.sin_addr);
    sockaddr out = {};
    std::memcpy(&out, &in, sizeof out);
    return out;
  };
  rtentry route = {};
  std::string device = "lo";
  route.rt_dst = address("224.0.0.0");
  route.rt_genmask = address("240.0.0.0");
  route.rt_flags = RTF_UP;
  route.rt_dev = device.data();
  if (ioctl(socket_fd.get(), SIOCADDRT, &route) != 0 && errno != EEXIST) {
    return Fail(fmt::format("--isolate: cannot route multicast: {}", std::strerror(errno)));
  }
  return {};
}

/// Group and port of "udpm://group:port?options".
struct Group {
  std::string address = "239.255.76.67";
  int port = 7667;
};

Result<Group> ParseGroup(const std::string& url) {
  Group group;
  std::string rest = url.substr(std::strlen("udpm://"));
  rest = rest.substr(0, rest.find('?'));
  if (rest.empty()) return group;
  const size_t colon = rest.find(':');
  if (colon != 0) group.address = rest.substr(0, colon);
  if (colon != std::string::npos) group.port = std::atoi(rest.c_str() + colon + 1);
  in_addr parsed = {};
  if (inet_pton(AF_INET, group.address.c_str(), &parsed) != 1 ||
      !IN_MULTICAST(ntohl(parsed.s_addr)) || group.port < 1 || group.port > 65535) {
    return Fail(fmt::format(
        "LCM URL {}: expected udpm://GROUP:PORT with a group in 224.0.0.0/4 and a port in 1..65535", url));
  }
  return group;
}

}  // namespace

std::string LcmUrl(const std::string& given) {
  if (!given.empty()) return given;
  const char* from_environment = std::getenv("LCM_DEFAULT_URL");
  if (from_environment != nullptr && *from_environment != '\0') return from_environment;
  return kDefaultUrl;
}

Result<void> EnterPrivateNetwork() {
  // Root keeps its rights over files by going without a user namespace.
  if (geteuid() != 0 || unshare(CLONE_NEWNET) != 0) {
    if (Result<void> entered = EnterUserNamespace(); !entered) return entered;
  }
  return BringLoopbackUp();
}

Result<void> JoinNetworkOf(pid_t pid) {
  namespace fs = std::filesystem;
  const std::string theirs = fmt::format("/proc/{}/ns/", pid);
  for (const auto& [name, flag] : {std::pair("user", CLONE_NEWUSER), std::pair("net", CLONE_NEWNET)}) {
    std::error_code ignored;
    const fs::path their_link = fs::read_symlink(theirs + name, ignored);
    if (their_link == fs::read_symlink(std::string("/proc/self/ns/") + name, ignored)) continue;
    const Descriptor ns(open((theirs + name).c_str(), O_RDONLY | O_CLOEXEC));
    if (ns.get() < 0 || setns(ns.get(), flag) != 0) {
      return Fail(fmt::format("cannot join the private network of process {}: {}", pid,
                              std::strerror(errno)));
    }
  }
  return {};
}

Result<void> CheckMulticast(const std::string& url) {
  if (url.rfind("udpm://", 0) != 0) return {};
  const Result<Group> group = ParseGroup(url);
  if (!group) return Fail(group.error().message);
  const Descriptor socket_fd(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(group->port));
  inet_pton(AF_INET, group->address.c_str(), &address.sin_addr);
  sockaddr generic = {};
  std::memcpy(&generic, &address, sizeof generic);
  if (connect(socket_fd.get(), &generic, sizeof generic) == 0) return {};
  return Fail(fmt::format(
      "there is no route for multicast to {} here ({}): run with --isolate, or make one with "
      "'sudo ip link set lo up multicast on && sudo ip route add 224.0.0.0/4 dev lo'",
      group->address, std::strerror(errno)));
}

}  // namespace morphbus::tools
