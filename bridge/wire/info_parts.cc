#include "bridge/wire/info_parts.h"

#include <algorithm>

#include "bridge/wire/wire_size.h"
#include "compiler/base/check.h"

namespace morphbus::bridge {
namespace {

/// Bytes of the description that one part carries at most: what its other fields leave.
constexpr size_t kPartBytes = kMaxPayloadBytes - SizeWithoutArrays<morphbus::info_part_t>();

}  // namespace

std::vector<morphbus::info_part_t> SplitInfo(const std::string& description) {
  MORPHBUS_CHECK(description.size() <= kMaxInfoBytes);
  // An empty description is one empty part.
  const size_t count = std::max<size_t>(1, (description.size() + kPartBytes - 1) / kPartBytes);
  std::vector<morphbus::info_part_t> parts(count);
  for (size_t i = 0; i < count; ++i) {
    // Each part but the last one is full.
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
  // A part that contradicts itself is refused; one of another description starts anew.
  const size_t fitting = std::max<size_t>(1, (total + kPartBytes - 1) / kPartBytes);
  if (part.part < 0 || part.part >= part.num_parts || count != fitting) return std::nullopt;
  if (part.total_bytes != total_bytes_ || parts_.size() != count) {
    total_bytes_ = part.total_bytes;
    parts_.assign(count, std::nullopt);
  }
  std::string bytes(part.data.begin(), part.data.end());
  // A repeated part finishes nothing; another one in its place is of another description.
  const std::optional<std::string>& slot = parts_[part.part];
  if (slot == bytes) return std::nullopt;
  if (slot) parts_.assign(count, std::nullopt);
  parts_[part.part] = std::move(bytes);
  // Whole once no part is missing.
  std::string whole;
  for (const std::optional<std::string>& piece : parts_) {
    if (!piece) return std::nullopt;
    whole += *piece;
  }
  // What comes next may be a later run's description of the same size, which shares parts with this
  // one. Parts of two descriptions may also have come together.
  parts_.assign(count, std::nullopt);
  if (whole.size() != total || whole == last_whole_) return std::nullopt;
  last_whole_ = whole;
  return whole;
}

}  // namespace morphbus::bridge
