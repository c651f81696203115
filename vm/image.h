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

inline constexpr uint32_t kMagic = 0x494e5944u;  // "DYNI"
inline constexpr uint16_t kVersion = 1;

enum class Section : uint8_t {
  kStrings,
  kKeywords,
  kConstants,
  kFunctions,
  kRoles,
  kJoins,
  kCode,
  kLines,
};
inline constexpr int kNumSections = 8;

// Offsets in the header.
inline constexpr uint32_t kVersionAt = 4;
inline constexpr uint32_t kSettleTicksAt = 6;
inline constexpr uint32_t kSizeAt = 8;
inline constexpr uint32_t kBudgetAt = 12;
inline constexpr uint32_t kHashAt = 16;
inline constexpr uint32_t kSourceNameAt = 24;
inline constexpr uint32_t kSectionsAt = 28;
inline constexpr uint32_t kHeaderBytes = kSectionsAt + 8 * kNumSections;

// Sizes of the records that have one.
inline constexpr uint32_t kTextBytes = 4;
inline constexpr uint32_t kKeywordBytes = 5;
inline constexpr uint32_t kConstantBytes = 5;
inline constexpr uint32_t kFunctionBytes = 36;
inline constexpr uint32_t kJoinBytes = 8;
inline constexpr uint32_t kLineBytes = 6;
inline constexpr int kRoleCounts = 8;
inline constexpr uint32_t kRoleHeadBytes = kTextBytes + 4 + kRoleCounts;

// Offsets in a function's record.
inline constexpr uint32_t kFunctionRoleAt = 4;
inline constexpr uint32_t kFunctionReturnAt = 5;
inline constexpr uint32_t kFunctionArgumentsAt = 6;
inline constexpr uint32_t kFunctionLocalsAt = 7;
inline constexpr uint32_t kFunctionCodeAt = 8;
inline constexpr uint32_t kFunctionCodeSizeAt = 12;
inline constexpr uint32_t kFunctionFirstJoinAt = 16;
inline constexpr uint32_t kFunctionJoinsAt = 18;
inline constexpr uint32_t kFunctionTypesAt = 20;

inline constexpr int kMaxLocals = 16;
inline constexpr int kMaxJoinDepth = 8;               ///< Operands on the stack at a join.
inline constexpr uint32_t kMaxFunctionBytes = 65535;  ///< Targets are 16 bits.

/// Written by the compiler unless told otherwise: cost units a tick, and ticks that the structure
/// must stay unchanged before requirements and labels are evaluated.
inline constexpr uint32_t kDefaultBudget = 20000;
inline constexpr uint16_t kDefaultSettleTicks = 10;

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

/// FNV-1a-64 over the whole image but the eight bytes of the hash itself. `size` >= kHeaderBytes.
uint64_t HashOf(const uint8_t* bytes, uint32_t size);

/// Begin and count of a section, from a header that has been checked for size only.
struct SectionRange {
  uint32_t begin = 0;
  uint32_t count = 0;
};
inline SectionRange SectionOf(const uint8_t* bytes, Section section) {
  const uint8_t* p = bytes + kSectionsAt + 8 * static_cast<uint32_t>(section);
  return {ReadU32(p), ReadU32(p + 4)};
}

}  // namespace morphbus::vm::image
