#include "bridge/bus/udpm_sender.h"

#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "bridge/bus/lcm_datagrams.h"

namespace morphbus::bridge {
namespace {

/// LCM sends longer messages in fragments (LCM_SHORT_MESSAGE_MAX_SIZE).
constexpr size_t kLongestShort = 65499;
constexpr size_t kMostChannelBytes = 63;

}  // namespace

std::unique_ptr<UdpmSender> UdpmSender::Open(const LcmUrl& url) {
  // Only on a loopback any address is ours to send from.
  if (MulticastInterface(url.group) != "lo") return nullptr;
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return nullptr;
  std::unique_ptr<UdpmSender> sender(new UdpmSender(fd, url));
  const auto hops = static_cast<uint8_t>(url.ttl);
  if (setsockopt(fd, IPPROTO_IP, IP_MULTICAST_TTL, &hops, sizeof hops) != 0) return nullptr;
  return sender;
}

UdpmSender::~UdpmSender() { close(fd_); }

bool UdpmSender::Send(std::string_view channel, const uint8_t* data, size_t size) {
  // What is too long for one datagram is left to LCM, which sends fragments.
  if (channel.size() > kMostChannelBytes || channel.size() + 1 + size > kLongestShort) return false;
  // Each address numbers its datagrams by itself, as a sender of LCM's.
  const auto source = static_cast<size_t>(SourceOf(channel));
  // LCM's header, and the channel's name with its NUL.
  std::array<char, 8 + kMostChannelBytes + 1> head = {};
  const std::array<uint32_t, 2> numbers = {htonl(kLcmShortMagic), htonl(sequences_[source]++)};
  std::memcpy(head.data(), numbers.data(), sizeof numbers);
  channel.copy(head.data() + sizeof numbers, channel.size());
  std::array<iovec, 2> parts = {
      {{head.data(), sizeof numbers + channel.size() + 1}, {const_cast<uint8_t*>(data), size}}};
  // The address that it comes from travels beside it.
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(in_pktinfo))> control = {};
  msghdr message = {};
  message.msg_name = &to_;
  message.msg_namelen = sizeof to_;
  message.msg_iov = parts.data();
  message.msg_iovlen = parts.size();
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  cmsghdr* header = CMSG_FIRSTHDR(&message);
  header->cmsg_level = IPPROTO_IP;
  header->cmsg_type = IP_PKTINFO;
  header->cmsg_len = CMSG_LEN(sizeof(in_pktinfo));
  in_pktinfo from = {};
  from.ipi_spec_dst = SourceAddress(static_cast<int>(source));
  std::memcpy(CMSG_DATA(header), &from, sizeof from);
  return sendmsg(fd_, &message, 0) >= 0;
}

}  // namespace morphbus::bridge
