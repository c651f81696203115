#pragma once
// What a receiver may believe of a message, field by field in their order, and thereby how large a
// message can get. Fields, types and ranges are those of lcmtypes/*.lcm (README.md there, Ranges),
// of which lcmtypes/layouts.py makes a function Walk for each type; what two fields must not say
// together stands here. One description serves every visitor, which says what a field means to it:
// WireReader (bridge/wire/wire_reader.h) checks bytes, WireSizer (bridge/wire/wire_size.h) adds
// sizes up. bridge/wire/wire_ranges.cc holds the ranges to the limits of the code.
//
// A visitor offers, with the names of the .lcm files, since failures quote them:
//   Int<T>(name, lowest, highest)                      a number in that range; returns it
//   Count<T>(name, lowest, highest)                    the length of an array; returns it
//   Bool(name)                                         0 or 1
//   Floats, Doubles(name, count)                       finite numbers
//   FloatQuaternion, DoubleQuaternion(name)            w x y z, of about unit length
//   Bytes(name, count)                                 anything
//   Text(name, longest), Texts(name, count, longest)   strings of at most so many bytes
//   Struct<M>(name), Structs<M>(name, count)           other messages
//   Refuse(name, why)                                  what fields must not say together

#include <morphbus/layouts.hpp>

namespace morphbus::layout {

/// What whole numbers of one struct must not say together. A Walk calls it once it has the last of
/// them, in which `n` has those of its type; a field of a name below means the same in any type.
template <class V, class M>
constexpr void CheckTogether(V& v, const Numbers<M>& n) {
  // Of messages in several parts: which of them this is.
  if constexpr (requires { n.part; }) {
    if (n.part >= n.num_parts) v.Refuse("part", "is not below num_parts");
  }
  // A piece of a package lies within it, so that collecting always ends. Nothing says that the
  // bytes are a program: the verifier sees to that once the package is whole.
  if constexpr (requires { n.offset; }) {
    if (n.offset + n.size > n.image_size) {
      v.Refuse("offset", "puts the piece beyond the package's end");
    }
  }
  // Of the ticks that were missed, some came later.
  if constexpr (requires { n.late; }) {
    if (n.late > n.missed) v.Refuse("late", "is above missed");
  }
  // A part of the description is no larger than the whole.
  if constexpr (requires { n.total_bytes; }) {
    if (n.size > n.total_bytes) v.Refuse("size", "is above total_bytes");
  }
}

}  // namespace morphbus::layout
