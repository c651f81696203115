#pragma once
// Layout of a program image. docs/vm.md describes it for readers; this header is what the
// compiler's writer, the verifier, the interpreter and the disassembler share. All numbers
// little-endian, nothing aligned.
//
// An image has two parts. The first is what modules run: a header and the sections in the order of
// `Section`, without gaps. The second, which may be left out, is for people: names and source
// lines. The header holds its hash, so both names belong together wherever they are kept.
//
//   header   magic u32, version u16, settle ticks u16, size of the first part u32, budget u32, hash
//            u64, hash of the second part u64, then a count u16 for each section
//   text     offset u16 in the strings section, size u8
//   keyword  kind u8, name text
//   constant type u8 (kParameterBit: a parameter, whose value a run may choose), value u32; that
//            of a text is its place in the strings, offset and size u16
//   types    type u8: lists of types, which functions share
//   function code begin u16, role u8, signature u16 (bits 0 to 3 the return type, 4 to 8 the number
//            of arguments, 9 to 13 that of locals), first of the locals' types u16
//   role     name text, parent u8 (kNoParent: none), depth u8 with kAbstractBit, then u8 counts of
//            fields, labels, requirements, startups, behaviors, commands, handlers, methods, then
//            their members: field {u16: the constant that is its first value, and kSharedFieldBit,
//            kKeptFieldBit (the next constant is its name), kTracedFieldBit},
//            handler {event u8: kEarlyBit and an event, or kFirstPeriod and the constant that is
//            the period of a timer, function u16}, all others {function u16}
//   state    set locals u16 (bits), stack types u32 (4 bits each, lowest first, 0 above the top)
//   join     offset u16 in the code section, state u16: what holds at a target of jumps; sorted
//
//   notes    magic u32, size of the strings u16, fields u16, locals u16, lines u16, source file
//            name (text), then the strings, for each function its name (text), for each field of
//            each role its name (text), for each local of each function its name (text), for each
//            parameter its name (text), then its value in the source, the least and the largest one
//            (u32 each), and the lines: offset u16 in the code section, line u16; sorted. Last, for
//            each imported file that has code, the first of its lines, which are counted on over
//            all files, u16, and its name (text); sorted

#include <cstdint>

namespace morphbus::vm::image {

/// The first bytes of every image of this version, and of its notes.
inline constexpr uint32_t kMagic = 0x494e5944u;       // "DYNI"
inline constexpr uint32_t kNotesMagic = 0x534e5944u;  // "DYNS"
/// The version that this build writes and reads; it reads no other.
inline constexpr uint16_t kVersion = 3;

/// The sections of the part that runs, in their order.
enum class Section : uint8_t {
  /// The bytes of all names that modules need, and of all texts.
  kStrings,
  kKeywords,
  kConstants,
  kTypes,
  kFunctions,
  kRoles,
  kStates,
  kJoins,
  kCode,
};
/// How many sections an image has; all are there, if only with no records.
inline constexpr int kNumSections = 9;

/// Offsets of the header's fields in the image (bytes).
inline constexpr uint32_t kVersionAt = 4;
inline constexpr uint32_t kSettleTicksAt = 6;
inline constexpr uint32_t kSizeAt = 8;
inline constexpr uint32_t kBudgetAt = 12;
inline constexpr uint32_t kHashAt = 16;
inline constexpr uint32_t kNotesHashAt = 24;
inline constexpr uint32_t kCountsAt = 32;
inline constexpr uint32_t kHeaderBytes = kCountsAt + 2 * kNumSections;

/// Sizes of the records that have one (bytes). A role's record has a head of fixed size, its counts
/// and then its members.
inline constexpr uint32_t kTextBytes = 3;
inline constexpr uint32_t kKeywordBytes = 1 + kTextBytes;
inline constexpr uint32_t kConstantBytes = 5;
inline constexpr uint32_t kFunctionBytes = 7;
inline constexpr uint32_t kStateBytes = 6;
inline constexpr uint32_t kJoinBytes = 4;
/// The number of counts in a role's head, one for each kind of member.
inline constexpr int kRoleCounts = 8;
inline constexpr uint32_t kRoleParentAt = kTextBytes;
inline constexpr uint32_t kRoleDepthAt = kTextBytes + 1;
inline constexpr uint32_t kRoleCountsAt = kTextBytes + 2;
inline constexpr uint32_t kRoleHeadBytes = kRoleCountsAt + kRoleCounts;
inline constexpr uint8_t kNoParent = 0xff;
inline constexpr uint8_t kAbstractBit = 0x80;

/// Sizes of the records that follow a role's head, in the order of its counts. All but those of
/// fields and handlers are the number of a function.
inline constexpr uint32_t kReferenceBytes = 2;
inline constexpr uint32_t kFieldBytes = 2;
inline constexpr uint32_t kHandlerBytes = 3;
inline constexpr uint32_t kRoleMemberBytes[kRoleCounts] = {
    kFieldBytes,     kReferenceBytes, kReferenceBytes, kReferenceBytes,
    kReferenceBytes, kReferenceBytes, kHandlerBytes,   kReferenceBytes};

/// Bytes of all records that follow a role's head, given its counts.
inline uint32_t RoleBodyBytes(const uint8_t* counts) {
  uint32_t bytes = 0;
  for (int i = 0; i < kRoleCounts; ++i) bytes += counts[i] * kRoleMemberBytes[i];
  return bytes;
}

/// Offsets in a function's record (bytes).
inline constexpr uint32_t kFunctionRoleAt = 2;
inline constexpr uint32_t kFunctionSignatureAt = 3;
inline constexpr uint32_t kFunctionTypesAt = 5;

/// Offsets in the notes (bytes), and the sizes of their records.
inline constexpr uint32_t kNotesStringsAt = 4;
inline constexpr uint32_t kNotesFieldsAt = 6;
inline constexpr uint32_t kNotesLocalsAt = 8;
inline constexpr uint32_t kNotesLinesAt = 10;
inline constexpr uint32_t kNotesSourceAt = 12;
inline constexpr uint32_t kNotesHeadBytes = kNotesSourceAt + kTextBytes;
inline constexpr uint32_t kLineBytes = 4;
inline constexpr uint32_t kImportedFileBytes = 2 + kTextBytes;
/// What the notes say of a parameter: its value in the source, the least and the largest one.
inline constexpr uint32_t kParameterBytes = 12;

/// What a field's record says beside the constant that is its first value: neighbours may read it;
/// its value outlives a change of role or program, and the next constant is the text of its name;
/// its value is told in every tick.
inline constexpr int kSharedFieldBit = 0x8000;
inline constexpr int kKeptFieldBit = 0x4000;
inline constexpr int kTracedFieldBit = 0x2000;
inline constexpr int kFieldConstantMask = 0x1fff;
/// Of the event of a handler that runs during startup too.
inline constexpr int kEarlyBit = 0x80;
/// Of the type of a constant that is a parameter, an int or a float: a run may choose its value.
inline constexpr int kParameterBit = 0x80;
/// The most parameters that a program may have.
inline constexpr int kMaxParameters = 64;
/// From here on the event of a handler is a timer's period, by its number in the constants.
inline constexpr int kFirstPeriod = 4;
inline constexpr int kMaxPeriods = 0x80 - kFirstPeriod;

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

/// FNV-1a-64 over all bytes of an image's first part but the eight of the hash itself. `size` >=
/// kHeaderBytes.
uint64_t HashOf(const uint8_t* bytes, uint32_t size);
/// The same over all bytes, for the notes.
uint64_t HashOfNotes(const uint8_t* bytes, uint32_t size);

/// Where a section begins (byte of the image) and how many records it has; bytes, for the strings
/// and the code.
struct SectionRange {
  uint32_t begin = 0;
  uint32_t count = 0;
};
/// Finds them by a header's counts, which may still be wrong. Roles have no fixed size: what
/// follows them is found from the end of the part that runs.
SectionRange SectionOf(const uint8_t* bytes, Section section);

}  // namespace morphbus::vm::image
