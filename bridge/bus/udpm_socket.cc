#include "bridge/bus/udpm_socket.h"

#include <arpa/inet.h>
#include <linux/sock_diag.h>
#include <netinet/in.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <string>

namespace morphbus::bridge {
namespace {

// Datagrams taken by one system call, and the largest that UDP can carry.
constexpr size_t kBatch = 32;
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
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_ANY);
  address.sin_port = htons(url.port);
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

/// Address and port as one number.
uint64_t SenderOf(const sockaddr_in& address) {
  return uint64_t{ntohl(address.sin_addr.s_addr)} << 16 | ntohs(address.sin_port);
}

}  // namespace

// Where the kernel puts a batch of datagrams.
struct UdpmSocket::Batch {
  Batch() : bytes(std::make_unique_for_overwrite<uint8_t[]>(kBatch * kLargestDatagram)) {
    for (size_t i = 0; i < kBatch; ++i) {
      parts[i] = {bytes.get() + i * kLargestDatagram, kLargestDatagram};
      headers[i] = {};
      headers[i].msg_hdr.msg_iov = &parts[i];
      headers[i].msg_hdr.msg_iovlen = 1;
      headers[i].msg_hdr.msg_name = &senders[i];
    }
  }

  /// The number of datagrams there were; 0 if none.
  size_t Fill(int fd) {
    for (mmsghdr& header : headers) header.msg_hdr.msg_namelen = sizeof(sockaddr_in);
    const int count = recvmmsg(fd, headers.data(), kBatch, MSG_DONTWAIT, nullptr);
    return count > 0 ? static_cast<size_t>(count) : 0;
  }

  std::unique_ptr<uint8_t[]> bytes;
  std::array<iovec, kBatch> parts;
  std::array<sockaddr_in, kBatch> senders = {};
  std::array<mmsghdr, kBatch> headers;
};

Result<std::unique_ptr<UdpmSocket>> UdpmSocket::Open(const LcmUrl& url) {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return Refused("open a socket");
  // A filter before the group is joined, so that nothing that nobody asked for ever queues up.
  std::unique_ptr<UdpmSocket> opened(new UdpmSocket(fd));
  opened->SetChannels({}, false);
  if (Result<void> joined = Join(fd, url); !joined) return tl::unexpected<Error>(joined.error());
  return opened;
}

UdpmSocket::UdpmSocket(int fd) : fd_(fd), batch_(std::make_unique<Batch>()) {}

UdpmSocket::~UdpmSocket() { close(fd_); }

bool UdpmSocket::SetChannels(const std::vector<ChannelInterest>& channels, bool fragments) {
  filtered_ = true;
  const std::vector<sock_filter> program = BuildChannelFilter(channels, fragments);
  return AttachFilter(fd_, program) && !program.empty();
}

void UdpmSocket::PassEverything() {
  if (!filtered_) return;
  AttachFilter(fd_, {});
  filtered_ = false;
  // From now on every drop is a datagram that found the buffer full.
  drops_before_ = Drops(fd_);
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

void UdpmSocket::Take(size_t most, const Sink& sink) {
  size_t count = batch_->Fill(fd_);
  for (size_t total = 0; count > 0;) {
    for (size_t i = 0; i < count; ++i) {
      const auto* data = static_cast<const uint8_t*>(batch_->parts[i].iov_base);
      sink(SenderOf(batch_->senders[i]), data, batch_->headers[i].msg_len);
    }
    total += count;
    // A batch that was not full has emptied the socket; what came since can wait for the next call.
    if (count < kBatch || total >= most) return;
    count = batch_->Fill(fd_);
  }
}

int64_t UdpmSocket::drops() const { return filtered_ ? 0 : Drops(fd_) - drops_before_; }

}  // namespace morphbus::bridge
