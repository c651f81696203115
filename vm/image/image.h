#pragma once
// Layout of a program image. docs/vm.md describes it for readers; this header is what the
// compiler's writer, the verifier, the interpreter and the disassembler share. All numbers
// little-endian, nothing aligned. The sections follow the header in the order of `Section`, without
// gaps.
//
//   header   magic u32, version u16, settle ticks u16, size u32, budget u32, hash u64,
//            source file name (text), then {begin u32, count u32} a section
//   text     offset u16 in the strings section, size u16
//   keyword  kind u8, name text
//   constant type u8, value u32
//   function name text, role u8, return type u8, arguments u8, locals u8, code begin u32,
//            code size u32, first join u16, joins u16, type u8 of each of 16 locals
//   role     name text, parent i16, abstract u8, depth u8, then u8 counts of fields, labels,
//            requirements, startups, behaviors, commands, handlers, methods, then these:
//            field {name, type u8, value u32}, label {name, type u8, function u16},
//            requirement {function u16}, startup, behavior, command {name, function u16},
//            handler {event u8, function u16}, method {function u16}
//   join     offset u16 in its function, set locals u16 (bits), stack types u32 (4 bits each,
//            lowest first, 0 above the top): the state at every target of a jump
//   line     offset u32 in the code section, line u16; sorted

#include <cstdint>

namespace morphbus::vm::image {

/// The first bytes of every image of this version.
inline constexpr uint32_t kMagic = 0x494e5944u;  // "DYNI"
/// The version that this build writes and reads; it reads no other.
inline constexpr uint16_t kVersion = 1;

/// The parts of an image, in their order.
enum class Section : uint8_t {
  /// The bytes of all names and texts.
  kStrings,
  kKeywords,
  kConstants,
  kFunctions,
  kRoles,
  kJoins,
  kCode,
  kLines,
};
/// How many sections an image has; all are there, if only with no records.
inline constexpr int kNumSections = 8;

/// Offsets of the header's fields in the image (bytes).
inline constexpr uint32_t kVersionAt = 4;
inline constexpr uint32_t kSettleTicksAt = 6;
inline constexpr uint32_t kSizeAt = 8;
inline constexpr uint32_t kBudgetAt = 12;
inline constexpr uint32_t kHashAt = 16;
inline constexpr uint32_t kSourceNameAt = 24;
inline constexpr uint32_t kSectionsAt = 28;
inline constexpr uint32_t kHeaderBytes = kSectionsAt + 8 * kNumSections;

/// Sizes of the records that have one (bytes). A role's record has a head of fixed size, its counts
/// and then its members.
inline constexpr uint32_t kTextBytes = 4;
inline constexpr uint32_t kKeywordBytes = 5;
inline constexpr uint32_t kConstantBytes = 5;
inline constexpr uint32_t kFunctionBytes = 36;
inline constexpr uint32_t kJoinBytes = 8;
inline constexpr uint32_t kLineBytes = 6;
/// The number of counts in a role's head, one for each kind of member.
inline constexpr int kRoleCounts = 8;
inline constexpr uint32_t kRoleHeadBytes = kTextBytes + 4 + kRoleCounts;
inline constexpr uint32_t kRoleCountsAt = kTextBytes + 4;

/// Sizes of the records that follow a role's head, in the order of its counts.
inline constexpr uint32_t kFieldBytes = kTextBytes + 5;
inline constexpr uint32_t kLabelBytes = kTextBytes + 3;
/// A requirement or a method, which is only the number of a function.
inline constexpr uint32_t kReferenceBytes = 2;
/// A startup, a behavior or a command.
inline constexpr uint32_t kRoutineBytes = kTextBytes + 2;
/// A handler, which is known by its event and has no name.
inline constexpr uint32_t kHandlerBytes = 3;
inline constexpr uint32_t kRoleMemberBytes[kRoleCounts] = {
    kFieldBytes,   kLabelBytes,   kReferenceBytes, kRoutineBytes,
    kRoutineBytes, kRoutineBytes, kHandlerBytes,   kReferenceBytes};

/// Bytes of all records that follow a role's head, given its counts.
inline uint32_t RoleBodyBytes(const uint8_t* counts) {
  uint32_t bytes = 0;
  for (int i = 0; i < kRoleCounts; ++i) bytes += counts[i] * kRoleMemberBytes[i];
  return bytes;
}

/// Offsets in a function's record (bytes).
inline constexpr uint32_t kFunctionRoleAt = 4;
inline constexpr uint32_t kFunctionReturnAt = 5;
inline constexpr uint32_t kFunctionArgumentsAt = 6;
inline constexpr uint32_t kFunctionLocalsAt = 7;
inline constexpr uint32_t kFunctionCodeAt = 8;
inline constexpr uint32_t kFunctionCodeSizeAt = 12;
inline constexpr uint32_t kFunctionFirstJoinAt = 16;
inline constexpr uint32_t kFunctionJoinsAt = 18;
inline constexpr uint32_t kFunctionTypesAt = 20;

/// The most locals that a function may have, its arguments included.
inline constexpr int kMaxLocals = 16;
/// The most operands that may be on the stack at a join: their types fill 32 bits.
inline constexpr int kMaxJoinDepth = 8;
/// The largest code of a function: targets of jumps are 16 bits.
inline constexpr uint32_t kMaxFunctionBytes = 65535;

/// What the compiler writes unless told otherwise: the cost units of a tick, and the ticks for
/// which the structure must stay unchanged before requirements and labels are evaluated.
inline constexpr uint32_t kDefaultBudget = 20000;
inline constexpr uint16_t kDefaultSettleTicks = 10;

/// Little-endian numbers at any address. The caller has checked that the bytes are there.
inline uint16_t ReadU16(const uint8_t* p) {
  return static_cast<uint16_t>(p[0] | static_cast<unsigned>(p[1]) << 8);
}
inline uint32_t ReadU32(const uint8_t* p) {
  return p[0] | static_cast<uint32_t>(p[1]) << 8 | static_cast<uint32_t>(p[2]) << 16 |
         static_cast<uint32_t>(p[3]) << 24;
}
inline uint64_t ReadU64(const uint8_t* p) {
  return ReadU32(p) | static_cast<uint64_t>(ReadU32(p + 4)) << 32;
}

/// How many of `count` entries `before` holds for; it holds for the first of them and for none
/// behind those. Found by halving.
template <class Before>
uint32_t FirstNot(uint32_t count, const Before& before) {
  uint32_t low = 0, high = count;
  while (low < high) {
    const uint32_t middle = low + (high - low) / 2;
    if (before(middle)) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

/// FNV-1a-64 over the whole image but the eight bytes of the hash itself. `size` >= kHeaderBytes.
uint64_t HashOf(const uint8_t* bytes, uint32_t size);

/// Where a section begins (byte of the image) and how many records it has; bytes, for the strings
/// and the code.
struct SectionRange {
  uint32_t begin = 0;
  uint32_t count = 0;
};
/// Reads them from a header that has been checked for its size only, so both may still be wrong.
inline SectionRange SectionOf(const uint8_t* bytes, Section section) {
  const uint8_t* p = bytes + kSectionsAt + 8 * static_cast<uint32_t>(section);
  return {ReadU32(p), ReadU32(p + 4)};
}

}  // namespace morphbus::vm::image
