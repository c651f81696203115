#pragma once
// The run's description, of any size, in parts of one datagram each (channel RUN/INFO).

#include <cstdint>
#include <morphbus/info_part_t.hpp>
#include <optional>
#include <string>
#include <vector>

namespace morphbus::bridge {

/// Largest description that is accepted, bytes.
inline constexpr size_t kMaxInfoBytes = 16u << 20;

/// Headers are left to the outbox. `description` is at most kMaxInfoBytes.
std::vector<morphbus::info_part_t> SplitInfo(const std::string& description);

/// Puts parts together, in any order, repeated or not. Parts of another size than the first one's
/// start anew.
class InfoAssembler {
 public:
  /// Returns the whole description when this part was the last one missing.
  std::optional<std::string> Take(const morphbus::info_part_t& part);

 private:
  int32_t total_bytes_ = -1;
  std::vector<std::optional<std::string>> parts_;
};

}  // namespace morphbus::bridge
