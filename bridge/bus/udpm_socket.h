#pragma once
// The receiving side of LCM's UDP multicast, without LCM's own receiving thread: that costs two
// more wake-ups and a handful of system calls a message, which is most of a lockstep's time.

#include <sys/socket.h>

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <vector>

#include "bridge/bus/channel_filter.h"
#include "bridge/bus/lcm_url.h"
#include "compiler/base/result.h"

namespace morphbus::bridge {

/// A socket in a multicast group, from which datagrams are taken in batches. It lives as long as
/// the bus that opened it, and closes its descriptor.
class UdpmSocket {
 public:
  /// Takes a datagram; `sender` (address and port as one number) tells the senders apart. The bytes
  /// are valid during the call only.
  using Sink = std::function<void(uint64_t sender, const uint8_t* data, size_t size)>;

  /// Joins the group; nothing is received before SetChannels or PassEverything. Fails in one
  /// sentence if the system refuses a step.
  static Result<std::unique_ptr<UdpmSocket>> Open(const LcmUrl& url);
  ~UdpmSocket();
  UdpmSocket(const UdpmSocket&) = delete;
  UdpmSocket& operator=(const UdpmSocket&) = delete;

  /// Lets the kernel pass what is of interest on exactly these channels, and with `fragments` the
  /// parts of messages that are too long for one datagram. Returns false if there are too many for
  /// a filter, or the kernel takes none: then everything passes.
  bool SetChannels(const std::vector<ChannelInterest>& channels, bool fragments);
  /// Takes the filter away: for loggers and spies.
  void PassEverything();

  /// Hands over the datagrams that are there, `most` about; does not wait for any.
  void Take(size_t most, const Sink& sink);

  /// Waits up to `timeout_us` until one of the sockets has a datagram; null ones are left out.
  static void Wait(std::initializer_list<const UdpmSocket*> sockets, int64_t timeout_us);

  /// Datagrams that found the socket's buffer full since everything passes. 0 while a filter is
  /// set: the kernel counts both in one number. (Sequence numbers show those losses.)
  [[nodiscard]] int64_t drops() const;

 private:
  /// Buffers for as many datagrams as one system call takes.
  struct Batch;
  explicit UdpmSocket(int fd);

  // The socket's descriptor, and whether a filter is set.
  int fd_;
  bool filtered_ = false;
  /// The kernel's count of drops when the filter was taken away.
  int64_t drops_before_ = 0;
  std::unique_ptr<Batch> batch_;
};

}  // namespace morphbus::bridge
