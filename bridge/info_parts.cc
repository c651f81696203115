#include "bridge/info_parts.h"

#include <algorithm>

#include "bridge/codec.h"
#include "compiler/source/check.h"

namespace morphbus::bridge {
namespace {

/// Largest number of bytes a part carries: what is left beside the header and the other fields.
constexpr size_t kPartBytes = kMaxPayloadBytes - 56 - 2 - 2 - 4 - 4;

}  // namespace

std::vector<morphbus::info_part_t> SplitInfo(const std::string& description) {
  MORPHBUS_CHECK(description.size() <= kMaxInfoBytes);
  const size_t count = std::max<size_t>(1, (description.size() + kPartBytes - 1) / kPartBytes);
  std::vector<morphbus::info_part_t> parts(count);
  for (size_t i = 0; i < count; ++i) {
    const size_t from = i * kPartBytes;
    const size_t size = std::min(kPartBytes, description.size() - from);
    parts[i].part = static_cast<int16_t>(i);
    parts[i].num_parts = static_cast<int16_t>(count);
    parts[i].total_bytes = static_cast<int32_t>(description.size());
    parts[i].size = static_cast<int32_t>(size);
    const auto begin = description.begin() + static_cast<std::ptrdiff_t>(from);
    parts[i].data.assign(begin, begin + static_cast<std::ptrdiff_t>(size));
  }
  return parts;
}

std::optional<std::string> InfoAssembler::Take(const morphbus::info_part_t& part) {
  const auto count = static_cast<size_t>(part.num_parts);
  const auto total = static_cast<size_t>(part.total_bytes);
  const size_t fitting = std::max<size_t>(1, (total + kPartBytes - 1) / kPartBytes);
  if (part.part < 0 || part.part >= part.num_parts || count != fitting) return std::nullopt;
  if (part.total_bytes != total_bytes_ || parts_.size() != count) {
    total_bytes_ = part.total_bytes;
    parts_.assign(count, std::nullopt);
  }
  std::optional<std::string>& slot = parts_[static_cast<size_t>(part.part)];
  const bool was_there = slot.has_value();
  slot = std::string(part.data.begin(), part.data.end());
  if (was_there) return std::nullopt;
  std::string whole;
  for (const std::optional<std::string>& piece : parts_) {
    if (!piece) return std::nullopt;
    whole += *piece;
  }
  if (whole.size() != total) {
    parts_.assign(count, std::nullopt);
    return std::nullopt;
  }
  return whole;
}

}  // namespace morphbus::bridge
