#pragma once
// The run's description, of any size, in parts of one datagram each (channel RUN/INFO). The logger
// sends them at the start and when asked; tools and logs put them together again.

#include <cstdint>
#include <morphbus/info_part_t.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bridge/wire/wire_limits.h"

namespace morphbus::bridge {

/// The description in as few parts as it takes, in order; an empty one is one empty part. Headers
/// are left to the outbox. `description` is at most kMaxInfoBytes.
std::vector<morphbus::info_part_t> SplitInfo(const std::string& description);

/// Puts parts together, in any order, repeated or not. Parts of another size than the first one's
/// start anew.
class InfoAssembler {
 public:
  /// Takes a part that Decode accepted. Returns the whole description when this part was the last
  /// one missing; nothing else, also for a part that contradicts itself or when it is the one
  /// before.
  std::optional<std::string> Take(const morphbus::info_part_t& part);

 private:
  /// Size of the description that is being put together; -1 before the first part.
  int32_t total_bytes_ = -1;
  /// The parts that have come, by number.
  std::vector<std::optional<std::string>> parts_;
  /// The description that was whole last: its parts may come again.
  std::optional<std::string> last_whole_;
};

}  // namespace morphbus::bridge
