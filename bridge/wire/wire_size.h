#pragma once
// Sizes of messages on the wire, worked out by the compiler from their layout. They tell at compile
// time that what the VM may put into a message fits into a datagram, and how much of a longer text
// or list fits into one part.

#include <cstddef>
#include <cstdint>

#include "bridge/wire/message_layout.h"

namespace morphbus::bridge {

/// The visitor of bridge/wire/message_layout.h that adds up bytes. It walks a layout without a
/// message; wherever a reader would get a number, it gets the highest that is allowed.
class WireSizer {
 public:
  /// @param full_arrays  whether arrays and byte strings count as long as they may be, else empty.
  constexpr explicit WireSizer(bool full_arrays) : full_arrays_(full_arrays) {}
  /// The sum so far.
  [[nodiscard]] constexpr size_t bytes() const { return bytes_; }

  /// Numbers have the size of their type. Their highest value is returned, which a layout may
  /// compare with another field but never goes by to walk further: only lengths do that.
  constexpr int64_t Int8(const char*, int64_t, int64_t highest) { return Number(1, highest); }
  constexpr int64_t Int16(const char*, int64_t, int64_t highest) { return Number(2, highest); }
  constexpr int64_t Int32(const char*, int64_t, int64_t highest) { return Number(4, highest); }
  constexpr int64_t Int64(const char*, int64_t, int64_t highest) { return Number(8, highest); }
  /// The length of an array: 0 or the highest, as the constructor was told. What is returned
  /// decides how many elements the layout then walks over.
  constexpr int64_t Count8(const char*, int64_t highest) { return Count(1, highest); }
  constexpr int64_t Count16(const char*, int64_t highest) { return Count(2, highest); }
  constexpr int64_t Count32(const char*, int64_t highest) { return Count(4, highest); }
  /// Flags are a byte, hashes eight.
  constexpr void Bool(const char*) { bytes_ += 1; }
  constexpr void Hash(const char*) { bytes_ += 8; }
  /// Numbers in IEEE 754: four bytes or eight; a quaternion has four of them.
  constexpr void Floats(const char*, int64_t count) { Bytes("", 4 * count); }
  constexpr void Doubles(const char*, int64_t count) { Bytes("", 8 * count); }
  constexpr void FloatQuaternion(const char*) { bytes_ += 4 * 4; }
  constexpr void DoubleQuaternion(const char*) { bytes_ += 4 * 8; }
  constexpr void Bytes(const char*, int64_t count) { bytes_ += static_cast<size_t>(count); }
  /// A string is its length (4 bytes), its bytes and a NUL. It counts as long as may be, whatever
  /// the constructor was told.
  constexpr void Text(const char*, size_t longest) { bytes_ += 4 + longest + 1; }
  constexpr void Texts(const char*, int64_t count, size_t longest) {
    for (int64_t i = 0; i < count; ++i) Text("", longest);
  }
  /// A struct is its fields one after another, with nothing between them; an array of structs has
  /// nothing between its elements either, and its length stands before it as a field of its own.
  template <class M>
  constexpr void Struct(const char*) {
    Walk(*this, layout::As<M>());
  }
  template <class M>
  constexpr void Structs(const char*, int64_t count) {
    // All elements are of one size, so one is walked over and multiplied.
    const size_t before = bytes_;
    Struct<M>("");
    bytes_ = before + (bytes_ - before) * static_cast<size_t>(count);
  }
  /// Sizes do not depend on what fields say together: what a reader would refuse is here the case
  /// of all fields at their highest, and just counts.
  constexpr void Refuse(const char*, const char*) {}

 private:
  /// A number's bytes; the highest value stands for it, since a length may be among them.
  constexpr int64_t Number(size_t size, int64_t highest) {
    bytes_ += size;
    return highest;
  }
  /// A length's bytes; what it yields is how many elements the layout walks over.
  constexpr int64_t Count(size_t size, int64_t highest) {
    return Number(size, full_arrays_ ? highest : 0);
  }

  bool full_arrays_;
  size_t bytes_ = 0;
};

/// The largest size of a struct within a message, bytes: arrays full, texts as long as may be. A
/// constant of the compiler's, so that static_asserts can compare it with the VM's limits.
template <class M>
constexpr size_t LargestSize() {
  WireSizer sizer(true);
  Walk(sizer, layout::As<M>());
  return sizer.bytes();
}

/// The size of a message of which all arrays are empty, with its fingerprint (8 bytes). What is
/// left of a datagram is the room for the arrays.
template <class M>
constexpr size_t SizeWithoutArrays() {
  WireSizer sizer(false);
  Walk(sizer, layout::As<M>());
  return sizer.bytes() + 8;
}

/// Where the first field behind the header stands in a payload, behind the type's fingerprint:
/// CLOCK's phase and SENSORS' part, by which the kernel tells what a module need not be woken for.
inline constexpr uint32_t kFirstFieldOffset =
    8 + static_cast<uint32_t>(LargestSize<morphbus::header_t>());

}  // namespace morphbus::bridge
