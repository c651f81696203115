#include "bridge/bus/udpm_socket.h"

#include <arpa/inet.h>
#include <linux/sock_diag.h>
#include <netinet/in.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <string>
#include <utility>

namespace morphbus::bridge {
namespace {

// Datagrams taken by one system call, what nearly all of them fit into, and the largest that UDP
// can carry.
constexpr size_t kBatch = 32;
constexpr size_t kUsualDatagram = 2048;
constexpr size_t kLargestDatagram = 65536;

/// What the system refused, in one sentence.
tl::unexpected<Error> Refused(const char* what) {
  return Fail(std::string("cannot ") + what + " to receive multicast: " + std::strerror(errno));
}

/// setsockopt, with its answer as a truth value.
bool SetOption(int fd, int level, int option, const void* value, socklen_t size) {
  return setsockopt(fd, level, option, value, size) == 0;
}

/// Binds to the group's port beside all others on this machine that do, and joins the group.
Result<void> Join(int fd, const LcmUrl& url) {
  const int on = 1;
  if (!SetOption(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on)) return Refused("share the port");
  // The kernel gives what net.core.rmem_max allows; what does not fit is lost, counted, asked
  // again.
  SetOption(fd, SOL_SOCKET, SO_RCVBUF, &url.receive_buffer, sizeof url.receive_buffer);
  const sockaddr_in address = SocketAddress(INADDR_ANY, url.port);
  if (bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return Refused("bind to the port");
  }
  ip_mreq membership = {};
  membership.imr_multiaddr.s_addr = htonl(url.group);
  membership.imr_interface.s_addr = htonl(INADDR_ANY);
  if (!SetOption(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership)) {
    return Refused("join the group");
  }
  // Only this group's datagrams, not those of whatever else this machine has joined.
  const int off = 0;
  SetOption(fd, IPPROTO_IP, IP_MULTICAST_ALL, &off, sizeof off);
  return {};
}

/// Datagrams that the kernel threw away, those that the filter refused among them.
int64_t Drops(int fd) {
  std::array<uint32_t, SK_MEMINFO_VARS> memory = {};
  socklen_t size = sizeof memory;
  if (getsockopt(fd, SOL_SOCKET, SO_MEMINFO, memory.data(), &size) != 0) return 0;
  return memory[SK_MEMINFO_DROPS];
}

}  // namespace

// Where the kernel puts a batch of datagrams.
struct UdpmSocket::Batch {
  // Beginnings lie close together; what goes beyond them has room of its own, of which no page is
  // touched as long as there is none: a hundred processes each have such a batch.
  Batch()
      : beginnings(std::make_unique_for_overwrite<uint8_t[]>(kBatch * kUsualDatagram)),
        bytes(std::make_unique_for_overwrite<uint8_t[]>(kBatch * kLargestDatagram)) {
    for (size_t i = 0; i < kBatch; ++i) {
      parts[i] = {{{Beginning(i), kUsualDatagram},
                   {Whole(i) + kUsualDatagram, kLargestDatagram - kUsualDatagram}}};
      headers[i] = {};
      headers[i].msg_hdr.msg_iov = parts[i].data();
      headers[i].msg_hdr.msg_iovlen = parts[i].size();
    }
  }
  [[nodiscard]] uint8_t* Beginning(size_t i) { return beginnings.get() + i * kUsualDatagram; }
  [[nodiscard]] uint8_t* Whole(size_t i) { return bytes.get() + i * kLargestDatagram; }

  /// The number of datagrams there were; 0 if none. `flags`: of recvmmsg(2), whether to wait for
  /// one.
  size_t Fill(int fd, bool arrivals, int flags = MSG_DONTWAIT) {
    // The kernel writes lengths over those that it is given, so that they are set each time.
    for (size_t i = 0; arrivals && i < kBatch; ++i) {
      headers[i].msg_hdr.msg_name = &senders[i];
      headers[i].msg_hdr.msg_namelen = sizeof senders[i];
      headers[i].msg_hdr.msg_control = &control[i];
      headers[i].msg_hdr.msg_controllen = sizeof control[i];
    }
    const int count = recvmmsg(fd, headers.data(), kBatch, flags, nullptr);
    return count > 0 ? static_cast<size_t>(count) : 0;
  }

  /// The datagram at place `i` of the batch.
  [[nodiscard]] Datagram At(size_t i, bool arrivals) {
    Datagram datagram = {Beginning(i), headers[i].msg_len};
    if (datagram.size > kUsualDatagram) {
      std::memcpy(Whole(i), Beginning(i), kUsualDatagram);
      datagram.data = Whole(i);
    }
    if (!arrivals) return datagram;
    datagram.sender =
        uint64_t{ntohl(senders[i].sin_addr.s_addr)} << 16 | ntohs(senders[i].sin_port);
    // The time is the only ancillary data that was asked for.
    msghdr& header = headers[i].msg_hdr;
    for (cmsghdr* c = CMSG_FIRSTHDR(&header); c != nullptr; c = CMSG_NXTHDR(&header, c)) {
      if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_TIMESTAMPNS) continue;
      timespec time = {};
      std::memcpy(&time, CMSG_DATA(c), sizeof time);
      datagram.arrival_ns = int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
    }
    return datagram;
  }

  /// Room for one ancillary message with a time in it.
  struct alignas(cmsghdr) Control {
    std::array<uint8_t, CMSG_SPACE(sizeof(timespec))> bytes;
  };
  std::unique_ptr<uint8_t[]> beginnings, bytes;
  std::array<std::array<iovec, 2>, kBatch> parts;
  std::array<mmsghdr, kBatch> headers;
  std::array<sockaddr_in, kBatch> senders;
  std::array<Control, kBatch> control;
};

Result<std::unique_ptr<UdpmSocket>> UdpmSocket::Open(const LcmUrl& url) {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return Refused("open a socket");
  // A filter before the group is joined, so that nothing queues up that was not asked for.
  std::unique_ptr<UdpmSocket> opened(new UdpmSocket(fd, url));
  opened->SetChannels({});
  if (Result<void> joined = Join(fd, url); !joined) return tl::unexpected<Error>(joined.error());
  return opened;
}

UdpmSocket::UdpmSocket(int fd, const LcmUrl& url)
    : fd_(fd),
      group_(url.group),
      on_loopback_(MulticastInterface(url.group) == "lo"),
      other_sources_(OtherSources()),
      batch_(std::make_unique<Batch>()) {}

UdpmSocket::~UdpmSocket() { close(fd_); }

bool UdpmSocket::SetChannels(const std::vector<ChannelInterest>& channels,
                             const ChannelPattern& pattern) {
  // A pattern's channels may come from anywhere.
  SourceSet needed;
  for (const ChannelInterest& channel : channels) needed.set(SourceOf(channel.channel));
  if (!pattern.prefix.empty()) needed.set();
  filtered_ = true;
  const std::vector<sock_filter> program = BuildChannelFilter(channels, pattern);
  const bool attached = AttachFilter(fd_, program);
  if (!attached) ++refused_filters_;
  const bool filters = attached && !program.empty();
  if (!filters) needed.set();
  ListenTo(needed);
  return filters;
}

void UdpmSocket::ListenTo(const SourceSet& sources) {
  const bool some = on_loopback_ && !sources.all();
  if (some && sources_ == sources) return;
  std::vector<in_addr> senders;
  for (int source = 0; some && source < kNumSources; ++source) {
    if (sources.test(source)) senders.push_back(SourceAddress(source));
  }
  if (some) {
    senders.insert(senders.end(), other_sources_.begin(), other_sources_.end());
    if (SetSenders(senders)) {
      sources_ = sources;
      return;
    }
  }
  // Before the group is joined there is nothing to be set.
  if (sources_ && SetSenders({})) sources_ = std::nullopt;
}

bool UdpmSocket::SetSenders(const std::vector<in_addr>& senders) {
  // The kernel's struct ends with the list, of which the header declares one element.
  std::vector<uint8_t> bytes(IP_MSFILTER_SIZE(std::max<size_t>(senders.size(), 1)));
  auto* filter = reinterpret_cast<ip_msfilter*>(bytes.data());
  filter->imsf_multiaddr.s_addr = htonl(group_);
  filter->imsf_interface.s_addr = htonl(INADDR_ANY);
  // To exclude no sender is to listen to all.
  filter->imsf_fmode = senders.empty() ? MCAST_EXCLUDE : MCAST_INCLUDE;
  filter->imsf_numsrc = static_cast<uint32_t>(senders.size());
  uint8_t* list = bytes.data() + IP_MSFILTER_SIZE(0);
  for (size_t i = 0; i < senders.size(); ++i) {
    std::memcpy(list + i * sizeof(in_addr), &senders[i], sizeof(in_addr));
  }
  return SetOption(fd_, IPPROTO_IP, IP_MSFILTER, bytes.data(),
                   static_cast<socklen_t>(IP_MSFILTER_SIZE(senders.size())));
}

void UdpmSocket::PassEverything() {
  if (!filtered_) return;
  ListenTo(SourceSet().set());
  AttachFilter(fd_, {});
  filtered_ = false;
  // From now on every drop is a datagram that found the buffer full.
  drops_before_ = Drops(fd_);
}

void UdpmSocket::TellArrivals() {
  const int on = 1;
  tells_arrivals_ = SetOption(fd_, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
}

void UdpmSocket::Wait(std::initializer_list<const UdpmSocket*> sockets, int64_t timeout_us) {
  std::array<pollfd, 2> ready = {};
  nfds_t count = 0;
  for (const UdpmSocket* socket : sockets) {
    if (socket != nullptr && count < ready.size()) ready[count++] = {socket->fd_, POLLIN, 0};
  }
  constexpr int64_t kSecond = 1'000'000;
  const timespec timeout = {timeout_us / kSecond, timeout_us % kSecond * 1000};
  ppoll(ready.data(), count, &timeout, nullptr);
}

void UdpmSocket::Await(int64_t timeout_us) {
  if (awaited_ > 0) return;
  // A socket's own timeout is exact to some milliseconds, and to set it is a system call: it has
  // one value for long waits and one for shorter ones, and what is left is waited for exactly.
  constexpr int64_t kLong = 100'000, kShort = 20'000;
  int64_t left_us = timeout_us;
  if (timeout_us >= kShort) {
    using std::chrono::steady_clock;
    const steady_clock::time_point begin = steady_clock::now();
    if (!SetReceiveTimeout(timeout_us >= kLong ? kLong : kShort)) return Wait({this}, timeout_us);
    errno = 0;
    awaited_ = batch_->Fill(fd_, tells_arrivals_, MSG_WAITFORONE);
    // A signal ends the wait, too.
    if (awaited_ > 0 || errno == EINTR) return;
    const auto waited =
        std::chrono::duration_cast<std::chrono::microseconds>(steady_clock::now() - begin);
    left_us = std::max<int64_t>(0, timeout_us - waited.count());
  }
  Wait({this}, left_us);
}

bool UdpmSocket::SetReceiveTimeout(int64_t us) {
  if (receive_timeout_us_ == us) return true;
  const timeval value = {0, us};
  if (!SetOption(fd_, SOL_SOCKET, SO_RCVTIMEO, &value, sizeof value)) return false;
  receive_timeout_us_ = us;
  return true;
}

void UdpmSocket::Take(size_t most, const Sink& sink) {
  size_t count = std::exchange(awaited_, 0);
  if (count == 0) count = batch_->Fill(fd_, tells_arrivals_);
  for (size_t total = 0; count > 0;) {
    for (size_t i = 0; i < count; ++i) sink(batch_->At(i, tells_arrivals_));
    total += count;
    // A batch that was not full has emptied the socket; what came since can wait for the next call.
    if (count < kBatch || total >= most) return;
    count = batch_->Fill(fd_, tells_arrivals_);
  }
}

int64_t UdpmSocket::drops() const { return filtered_ ? 0 : Drops(fd_) - drops_before_; }

}  // namespace morphbus::bridge
