#pragma once
// Sizes of messages on the wire, worked out by the compiler from their layout. They tell at compile
// time that what the VM may put into a message fits into a datagram, and how much of a longer text
// or list fits into one part.

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "bridge/wire/message_layout.h"
#include "compiler/base/check.h"

namespace morphbus::bridge {

/// A field of a message, as its layout has it.
struct LaidOutField {
  bool found = false;
  size_t offset = 0;    ///< From the message's first field on, all arrays before it empty; bytes.
  int64_t highest = 0;  ///< Of numbers with a range; of texts the longest length. Else 0.
};

/// The visitor of bridge/wire/message_layout.h that adds up bytes. It walks a layout without a
/// message; wherever a reader would get a number, it gets the highest that is allowed.
class WireSizer {
 public:
  /// @param full_arrays  whether arrays and byte strings count as long as they may be, else empty.
  /// @param wanted       the name of a field that shall be noted on the way; not one of an inner
  ///                     struct.
  constexpr explicit WireSizer(bool full_arrays, std::string_view wanted = {})
      : full_arrays_(full_arrays), wanted_(wanted) {}
  /// The sum so far.
  [[nodiscard]] constexpr size_t bytes() const { return bytes_; }
  /// What was wanted, if it has come.
  [[nodiscard]] constexpr const LaidOutField& field() const { return field_; }

  /// Numbers have the size of their type. Their highest value is returned, which a layout may
  /// compare with another field but never goes by to walk further: only lengths do that.
  template <class T>
  constexpr int64_t Int(const char* name, int64_t, int64_t highest) {
    return Number(name, sizeof(T), highest);
  }
  /// The length of an array: 0 or the highest, as the constructor was told. What is returned
  /// decides how many elements the layout then walks over.
  template <class T>
  constexpr int64_t Count(const char* name, int64_t, int64_t highest) {
    const int64_t count = Number(name, sizeof(T), highest);
    return full_arrays_ ? count : 0;
  }
  /// A flag is a byte.
  constexpr void Bool(const char* name) { Bytes(name, 1); }
  /// Numbers in IEEE 754: four bytes or eight; a quaternion has four of them.
  constexpr void Floats(const char* name, int64_t count) { Bytes(name, 4 * count); }
  constexpr void Doubles(const char* name, int64_t count) { Bytes(name, 8 * count); }
  constexpr void FloatQuaternion(const char* name) { Bytes(name, 4 * 4); }
  constexpr void DoubleQuaternion(const char* name) { Bytes(name, 4 * 8); }
  constexpr void Bytes(const char* name, int64_t count) {
    Number(name, static_cast<size_t>(count), 0);
  }
  /// A string is its length (4 bytes), its bytes and a NUL. It counts as long as may be, whatever
  /// the constructor was told.
  constexpr void Text(const char* name, size_t longest) {
    Number(name, 4 + longest + 1, static_cast<int64_t>(longest));
  }
  constexpr void Texts(const char* name, int64_t count, size_t longest) {
    for (int64_t i = 0; i < count; ++i) Text(name, longest);
  }
  /// A struct is its fields one after another, with nothing between them; an array of structs has
  /// nothing between its elements either, and its length stands before it as a field of its own.
  template <class M>
  constexpr void Struct(const char*) {
    Structs<M>("", 1);
  }
  template <class M>
  constexpr void Structs(const char*, int64_t count) {
    // All elements are of one size, so one is walked over and multiplied.
    WireSizer element(full_arrays_);
    Walk(element, layout::As<M>());
    bytes_ += element.bytes() * static_cast<size_t>(count);
  }
  /// Sizes do not depend on what fields say together: what a reader would refuse is here the case
  /// of all fields at their highest, and just counts.
  constexpr void Refuse(const char*, const char*) {}

 private:
  /// A field's bytes; the highest value stands for a number, since a length may be among them.
  constexpr int64_t Number(const char* name, size_t size, int64_t highest) {
    if (name == wanted_) field_ = {true, bytes_, highest};
    bytes_ += size;
    return highest;
  }

  bool full_arrays_;
  size_t bytes_ = 0;
  std::string_view wanted_;
  LaidOutField field_;
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

/// A field of M by its name in the .lcm file; there must be one, and no struct.
template <class M>
constexpr LaidOutField FieldOf(std::string_view name) {
  WireSizer sizer(false, name);
  Walk(sizer, layout::As<M>());
  MORPHBUS_CHECK(sizer.field().found);
  return sizer.field();
}

/// Where a field stands in a payload, behind the fingerprint, with all arrays before it empty:
/// bytes. What is not in an array is read there, and the kernel filters by it.
template <class M>
consteval uint32_t OffsetOf(std::string_view name) {
  return 8 + static_cast<uint32_t>(FieldOf<M>(name).offset);
}

}  // namespace morphbus::bridge
