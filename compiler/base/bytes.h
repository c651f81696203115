#pragma once
// Unsigned integers in big-endian byte order, as LCM's messages, datagrams and logs have them.
// Images are little-endian and have readers of their own (vm/image/image.h).
// They are constant expressions, so that the compiler can work out magic words.

#include <cstdint>

namespace morphbus {

/// The unsigned integer in the `count` bytes (1 to 8) at `bytes`, the most significant byte first.
/// The caller has checked that there are so many.
[[nodiscard]] constexpr uint64_t ReadBig(const uint8_t* bytes, int count) {
  uint64_t value = 0;
  for (int i = 0; i < count; ++i) value = value << 8U | bytes[i];
  return value;
}

/// Writes the lowest `count` bytes (1 to 8) of `value` to `out`, the most significant byte first.
/// The caller has made room for them.
/// Higher bits of `value` are left out without a word.
constexpr void WriteBig(uint64_t value, int count, uint8_t* out) {
  for (int i = 0; i < count; ++i) out[i] = static_cast<uint8_t>(value >> 8U * (count - 1 - i));
}

}  // namespace morphbus
