#pragma once
// Numbers in network order, as LCM and its logs have them.

#include <bit>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace morphbus {

/// The unsigned number of type U that stands in network order at `at`, which need not be aligned.
/// One instruction or two, where a loop over the bytes takes one for each of them.
template <class U>
U LoadBigEndian(const uint8_t* at) {
  static_assert(std::is_unsigned_v<U>);
  U value;
  std::memcpy(&value, at, sizeof value);
  if constexpr (std::endian::native == std::endian::big || sizeof(U) == 1) return value;
  if constexpr (sizeof(U) == 2) return __builtin_bswap16(value);
  if constexpr (sizeof(U) == 4) return __builtin_bswap32(value);
  if constexpr (sizeof(U) == 8) return __builtin_bswap64(value);
}

/// Writes the unsigned number in network order at `at`, which need not be aligned.
template <class U>
void StoreBigEndian(U value, uint8_t* at) {
  const U swapped = LoadBigEndian<U>(reinterpret_cast<const uint8_t*>(&value));
  std::memcpy(at, &swapped, sizeof swapped);
}

}  // namespace morphbus
