#pragma once
// The receiving side of LCM's UDP multicast, without LCM's own receiving thread: that costs two
// more wake-ups and a handful of system calls a message, which is most of a lockstep's time.

#include <netinet/in.h>
#include <sys/socket.h>

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <vector>

#include "bridge/bus/channel_filter.h"
#include "bridge/bus/lcm_url.h"
#include "bridge/bus/udpm_sources.h"
#include "compiler/base/result.h"

namespace morphbus::bridge {

/// One datagram as the kernel hands it over. The bytes are valid during the call only.
struct Datagram {
  const uint8_t* data;
  size_t size;
  /// When the kernel received it, nanoseconds since 1970, however late this process comes to read
  /// it; 0 unless TellArrivals was called.
  int64_t arrival_ns = 0;
  /// The sender's address and port, as one number that only tells senders apart; 0 unless
  /// TellArrivals was called.
  uint64_t sender = 0;
};

/// A socket in a multicast group, from which datagrams are taken in batches. It lives as long as
/// the bus that opened it, and closes its descriptor.
class UdpmSocket {
 public:
  /// Takes a datagram.
  using Sink = std::function<void(const Datagram& datagram)>;

  /// Joins the group; nothing is received before SetChannels or PassEverything. Fails in one
  /// sentence if the system refuses a step.
  static Result<std::unique_ptr<UdpmSocket>> Open(const LcmUrl& url);
  ~UdpmSocket();
  UdpmSocket(const UdpmSocket&) = delete;
  UdpmSocket& operator=(const UdpmSocket&) = delete;

  /// Lets the kernel pass what is of interest on these channels and the pattern's, and of many
  /// channels some that are not (bridge/bus/channel_filter.h). Returns false if there are too many
  /// for a filter, or the kernel takes none: then everything passes.
  bool SetChannels(const std::vector<ChannelInterest>& channels,
                   const ChannelPattern& pattern = {});
  /// Takes the filter away: for loggers and spies.
  void PassEverything();

  /// From now on datagrams say when they came and from whom, which costs the kernel some work for
  /// each. Times are the kernel's own (SO_TIMESTAMPNS of socket(7), on CLOCK_REALTIME).
  void TellArrivals();

  /// Hands over the datagrams that are there, `most` about; does not wait for any.
  void Take(size_t most, const Sink& sink);

  /// Waits up to `timeout_us` until there is a datagram. Mostly waiting for it and taking it are
  /// one system call; the next Take() hands it over.
  void Await(int64_t timeout_us);

  /// Waits up to `timeout_us` until one of the sockets has a datagram; null ones are left out.
  static void Wait(std::initializer_list<const UdpmSocket*> sockets, int64_t timeout_us);

  /// The descriptor for poll().
  [[nodiscard]] int fd() const { return fd_; }

  /// Datagrams that found the socket's buffer full since everything passes. 0 while a filter is
  /// set: the kernel counts both in one number. (Sequence numbers show those losses.)
  [[nodiscard]] int64_t drops() const;

  /// How often the kernel refused a filter.
  [[nodiscard]] int64_t refused_filters() const { return refused_filters_; }

 private:
  /// Buffers for as many datagrams as one system call takes.
  struct Batch;
  UdpmSocket(int fd, const LcmUrl& url);
  /// How long the kernel lets Await() wait, less than a second. Returns false if it refuses.
  bool SetReceiveTimeout(int64_t us);
  /// Lets the kernel pass only what comes from these addresses, if the group is on the loopback and
  /// the kernel takes a list of so many (net.ipv4.igmp_max_msf, 10 unless set); else what comes
  /// from anywhere.
  void ListenTo(const SourceSet& sources);
  /// Whether the kernel takes these senders; none: all.
  bool SetSenders(const std::vector<in_addr>& senders);

  // The socket's descriptor, and whether a filter is set.
  int fd_;
  bool filtered_ = false;
  int64_t refused_filters_ = 0;
  bool tells_arrivals_ = false;  ///< Whether each datagram says when it came and from whom.
  /// The group, in host byte order; whether only this machine can speak in it, and the addresses
  /// that are listened to, if not all are.
  uint32_t group_;
  bool on_loopback_;
  std::vector<in_addr> other_sources_;
  std::optional<SourceSet> sources_;
  /// The kernel's count of drops when the filter was taken away.
  int64_t drops_before_ = 0;
  std::unique_ptr<Batch> batch_;
  /// Datagrams in the batch that Await() has taken, and how long the kernel waits for one.
  size_t awaited_ = 0;
  int64_t receive_timeout_us_ = 0;
};

}  // namespace morphbus::bridge
