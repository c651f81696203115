#pragma once
// Whether the log holds what was published. At the end every process tells what it published,
// channel by channel, and the logger what it recorded; both count on their own. Only what has the
// run's key gets that far, so a difference is a mistake of ours.

#include <cstdint>
#include <functional>
#include <morphbus/totals_t.hpp>
#include <set>
#include <string>
#include <vector>

#include "bridge/wire/stream_hash.h"

namespace morphbus::bridge {

/// Totals as the messages that carry them, each small enough for a datagram; at least one.
/// @param process, last_tick  as in totals_t.
std::vector<morphbus::totals_t> SplitTotals(const std::string& process, int64_t last_tick,
                                            const std::vector<ChannelTotal>& totals);

/// Puts the parts of one process's totals together. What it reports again, of the same tick or a
/// later one, takes the place of what it said before as soon as all of it has come.
class TotalsParts {
 public:
  /// Takes a part. Returns true if it is the last one needed. Parts that came before, of an earlier
  /// tick, or that cannot be, change nothing.
  bool Take(const morphbus::totals_t& part);
  /// The last report that has come as a whole; there is one once Take said so.
  [[nodiscard]] const std::vector<ChannelTotal>& totals() const { return whole_; }
  [[nodiscard]] bool complete() const { return complete_; }

 private:
  // The report that is coming: what it speaks of, its hash, which of its parts are there, and what
  // they say.
  int64_t last_tick_ = -1;
  int64_t report_hash_ = 0;
  std::vector<bool> parts_;
  std::vector<ChannelTotal> gathered_;
  // The last whole one.
  bool complete_ = false;
  std::vector<ChannelTotal> whole_;
};

/// Names the channel, the first in order of name, of which the log holds other messages than were
/// published, more or fewer, and says how many more there are; empty if all agree.
/// @param unvouched  processes whose predecessor died and left nothing behind: what is recorded on
///                   their channels, and not among what is published, nobody else can know.
std::string WhereTheLogDiffers(const std::vector<ChannelTotal>& published,
                               const std::vector<ChannelTotal>& recorded,
                               const std::set<std::string, std::less<>>& unvouched = {});

}  // namespace morphbus::bridge
