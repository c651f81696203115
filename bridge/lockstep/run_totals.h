#pragma once
// Whether the log holds what was published. At the end every process tells what it published,
// channel by channel, and the logger what it recorded; both count on their own. Only what has the
// run's key gets that far, so a difference is a mistake of ours.

#include <cstdint>
#include <morphbus/totals_t.hpp>
#include <string>
#include <vector>

#include "bridge/wire/stream_hash.h"

namespace morphbus::bridge {

/// Totals as the messages that carry them, each small enough for a datagram; at least one.
/// @param process, last_tick  as in totals_t.
std::vector<morphbus::totals_t> SplitTotals(const std::string& process, int64_t last_tick,
                                            const std::vector<ChannelTotal>& totals);

/// Puts the parts of one process's totals together. A process that acknowledges a later tick than
/// before reports anew.
class TotalsParts {
 public:
  /// Takes a part. Returns true if it is the last one needed. Parts that came before, or that
  /// cannot be, change nothing.
  bool Take(const morphbus::totals_t& part);
  /// All of them; complete once Take said so.
  [[nodiscard]] const std::vector<ChannelTotal>& totals() const { return totals_; }
  [[nodiscard]] bool complete() const { return missing_ == 0; }

 private:
  std::vector<bool> parts_;  ///< Which parts have come.
  int missing_ = -1;         ///< Parts that have not come; -1 before the first one.
  int64_t last_tick_ = -1;   ///< What the totals speak of.
  std::vector<ChannelTotal> totals_;
};

/// Names the channel, the first in order of name, of which the log holds other messages than were
/// published, and says how many more there are; empty if all agree.
std::string WhereTheLogDiffers(const std::vector<ChannelTotal>& published,
                               const std::vector<ChannelTotal>& recorded);

}  // namespace morphbus::bridge
