#pragma once
// A classic BPF program that lets the kernel pass only some LCM channels to a UDP socket.

#include <linux/filter.h>

#include <string>
#include <vector>

#include "bridge/bus/bus.h"

namespace morphbus::bridge {

/// A channel, and what of it shall pass.
struct ChannelInterest {
  std::string channel;
  Interest interest;
};

/// Program for a UDP socket (offset 0 is the UDP header): passes fragments ("LC03", whose channel
/// stands only in the first one) if `fragments`, and what is of interest of the short messages
/// ("LC02") on exactly these channels; drops everything else. Empty if the channels need more
/// instructions than the kernel takes (4096): then do without a filter.
std::vector<sock_filter> BuildChannelFilter(std::vector<ChannelInterest> channels,
                                            bool fragments = true);

/// Attaches the program to the socket, replacing an earlier one; an empty program detaches.
/// Returns false if the kernel refuses.
bool AttachFilter(int fd, const std::vector<sock_filter>& program);

}  // namespace morphbus::bridge
