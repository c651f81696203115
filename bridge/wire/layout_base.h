#pragma once
// What the descriptions of messages in bridge/wire/message_layout.h are made with.

#include <cstddef>
#include <cstdint>
#include <limits>

#include "vm/limits.h"

namespace morphbus::bridge::layout {

// The bounds of the integer types, for fields that may have any value of theirs.
inline constexpr int64_t kMost8 = std::numeric_limits<int8_t>::max();
inline constexpr int64_t kMost16 = std::numeric_limits<int16_t>::max();
inline constexpr int64_t kMost32 = std::numeric_limits<int32_t>::max();
inline constexpr int64_t kMost64 = std::numeric_limits<int64_t>::max();
inline constexpr int64_t kLeast32 = std::numeric_limits<int32_t>::min();
inline constexpr int64_t kLeast64 = std::numeric_limits<int64_t>::min();
inline constexpr size_t kNameText = 64;      ///< Names of types, roles, functions; bytes.
inline constexpr size_t kMaxValueText = 96;  ///< Values of programs as text; bytes.
inline constexpr size_t kRunHashText = 32;   ///< Hexadecimal digits.
// Entries of the arrays that vm/limits.h says nothing of.
inline constexpr int64_t kMostControls = 64;
inline constexpr int64_t kMostTotals = 32;  ///< In one TOTALS; the log's END has more.
// The highest index of a link, joint and connector of any module type.
inline constexpr int64_t kLastLink = vm::kMaxLinks - 1;
inline constexpr int64_t kLastJoint = vm::kMaxJoints - 1;
inline constexpr int64_t kLastConnector = vm::kMaxConnectors - 1;

/// Stands for the type whose layout a Walk describes, so that one name, Walk, serves all types: the
/// compiler chooses by this argument, which has no content.
template <class M>
struct As {};

/// The length of an array of structs, which is at most `most`, and the structs.
template <class M, class V>
constexpr void List8(V& v, const char* length, const char* structs, int64_t most) {
  v.template Structs<M>(structs, v.Count8(length, most));
}
template <class M, class V>
constexpr void List16(V& v, const char* length, const char* structs, int64_t most) {
  v.template Structs<M>(structs, v.Count16(length, most));
}

/// Number of this part and number of parts.
template <class V>
constexpr void WalkPart(V& v) {
  const int64_t part = v.Int16("part", 0, kMost16);
  if (v.Int16("num_parts", 1, kMost16) <= part) v.Refuse("part", "is not below num_parts");
}

}  // namespace morphbus::bridge::layout
