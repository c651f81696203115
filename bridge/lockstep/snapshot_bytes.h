#pragma once
// Numbers and texts as the bytes of a snapshot, and back. Snapshots are read by the build that
// wrote them, on the same machine, so native order will do.

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

namespace morphbus::bridge {

/// Bytes that are left out together if all of them are zero.
inline constexpr size_t kSparseBlock = 64;

/// How many blocks there are in so many bytes.
inline size_t NumSparseBlocks(size_t size) { return (size + kSparseBlock - 1) / kSparseBlock; }

/// Appends bytes as they stand in memory.
inline void PutRaw(std::vector<uint8_t>* out, const void* data, size_t size) {
  const auto* bytes = static_cast<const uint8_t*>(data);
  out->insert(out->end(), bytes, bytes + size);
}

/// Appends a value without pointers.
template <class T>
void PutBytes(std::vector<uint8_t>* out, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  PutRaw(out, &value, sizeof value);
}

/// Appends a text with its length.
inline void PutText(std::vector<uint8_t>* out, const std::string& text) {
  PutBytes(out, static_cast<uint32_t>(text.size()));
  PutRaw(out, text.data(), text.size());
}

/// Appends memory that is mostly zero: which of its blocks are not, and those. A module saves its
/// state in every tick, and copying is most of what that costs.
inline void PutSparse(std::vector<uint8_t>* out, const void* memory, size_t size) {
  const auto* bytes = static_cast<const uint8_t*>(memory);
  constexpr std::array<uint8_t, kSparseBlock> kZero = {};
  const size_t marks = out->size();
  // Room for the worst case; the rest is given back at the end.
  out->resize(marks + NumSparseBlocks(size) + size);
  uint8_t* mark = out->data() + marks;
  uint8_t* to = mark + NumSparseBlocks(size);
  for (size_t at = 0; at < size; at += kSparseBlock) {
    const size_t block = std::min(kSparseBlock, size - at);
    *mark = std::memcmp(bytes + at, kZero.data(), block) != 0 ? 1 : 0;
    if (*mark++ == 0) continue;
    std::memcpy(to, bytes + at, block);
    to += block;
  }
  out->resize(static_cast<size_t>(to - out->data()));
}

/// Reads back what was put. The bytes may be cut or damaged: `ok` turns false at their end, and
/// from then on every value is zero.
struct SnapshotReader {
  // The bytes that were not read yet.
  const uint8_t* data;
  size_t left;
  bool ok = true;

  /// The next bytes as they stand; null once there are not as many left.
  const uint8_t* Take(size_t size) {
    if (size > left) ok = false;
    if (!ok) return nullptr;
    data += size;
    left -= size;
    return data - size;
  }
  template <class T>
  T Get() {
    T value{};
    if (const uint8_t* from = Take(sizeof value)) std::memcpy(&value, from, sizeof value);
    return value;
  }
  /// Fills memory of the size that was put; false, with some of it filled, if the bytes are not
  /// such.
  bool GetSparse(void* memory, size_t size) {
    auto* bytes = static_cast<uint8_t*>(memory);
    const uint8_t* marks = Take(NumSparseBlocks(size));
    for (size_t at = 0; ok && at < size; at += kSparseBlock, ++marks) {
      const size_t block = std::min(kSparseBlock, size - at);
      const uint8_t* from = *marks == 1 ? Take(block) : nullptr;
      ok = ok && *marks <= 1;
      if (from != nullptr) std::memcpy(bytes + at, from, block);
      if (*marks == 0) std::memset(bytes + at, 0, block);
    }
    return ok;
  }
  std::string GetText() {
    const auto size = Get<uint32_t>();
    const uint8_t* from = Take(size);
    return from == nullptr ? std::string() : std::string(reinterpret_cast<const char*>(from), size);
  }
};

}  // namespace morphbus::bridge
