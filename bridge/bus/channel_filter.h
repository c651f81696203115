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

/// Channels whose names begin and end so, if any shall pass besides (prefix not empty).
struct ChannelPattern {
  std::string prefix, suffix;
};

/// Program for a UDP socket (offset 0 is the UDP header): passes what is of interest of the
/// messages of one datagram ("LC02") on these channels, and what comes on channels of the pattern,
/// of whose suffix only the first four characters are looked at; drops everything else, fragments
/// of longer messages ("LC03") too. A few channels pass exactly. Of many channels RUN/NAME/TOPIC
/// the names are told apart by a hash of ten bits (Bloom, CACM 13(7), 1970, with one hash
/// function), so that the program does not grow with a robot; then others' messages of the same run
/// and topic may pass, too. Empty if the channels need more instructions all the same than the
/// kernel takes (4096): then do without a filter.
std::vector<sock_filter> BuildChannelFilter(std::vector<ChannelInterest> channels,
                                            const ChannelPattern& pattern = {});

/// Attaches the program to the socket, replacing an earlier one; an empty program detaches.
/// Returns false if the kernel refuses (there is a limit to a socket's memory for such things,
/// net.core.optmem_max): then no program is attached, and everything passes.
bool AttachFilter(int fd, const std::vector<sock_filter>& program);

}  // namespace morphbus::bridge
