#include "vm/image/image.h"

namespace morphbus::vm::image {

namespace {

/// Bytes of a record of each section; roles have no fixed size.
constexpr uint32_t kRecordBytes[kNumSections] = {
    1, kKeywordBytes, kConstantBytes, 1, kFunctionBytes, 0, kStateBytes, kJoinBytes, 1};

/// FNV-1a (http://www.isthe.com/chongo/tech/comp/fnv/), one byte.
uint64_t Mixed(uint64_t hash, uint8_t byte) { return (hash ^ byte) * 0x100000001b3u; }

constexpr uint64_t kBasis = 0xcbf29ce484222325u;

}  // namespace

// The hash's own bytes are left out.
uint64_t HashOf(const uint8_t* bytes, uint32_t size) {
  uint64_t hash = kBasis;
  for (uint32_t i = 0; i < size; ++i) {
    if (i >= kHashAt && i < kHashAt + 8) continue;
    hash = Mixed(hash, bytes[i]);
  }
  return hash;
}

uint64_t HashOfNotes(const uint8_t* bytes, uint32_t size) {
  uint64_t hash = kBasis;
  for (uint32_t i = 0; i < size; ++i) hash = Mixed(hash, bytes[i]);
  return hash;
}

SectionRange SectionOf(const uint8_t* bytes, Section section) {
  // Roles have no fixed size: what stands before them is counted from the header on, what stands
  // behind them back from the end.
  const auto count = [bytes](int i) -> uint32_t {
    return ReadU16(bytes + kCountsAt + 2 * static_cast<uint32_t>(i));
  };
  const int wanted = static_cast<int>(section);
  if (section <= Section::kRoles) {
    uint32_t begin = kHeaderBytes;
    for (int i = 0; i < wanted; ++i) begin += kRecordBytes[i] * count(i);
    return {begin, count(wanted)};
  }
  uint32_t begin = ReadU32(bytes + kSizeAt);
  for (int i = kNumSections - 1; i >= wanted; --i) begin -= kRecordBytes[i] * count(i);
  return {begin, count(wanted)};
}

}  // namespace morphbus::vm::image
