#pragma once
// Operands of instructions as data, generated from vm/image/operands.def: which parts each kind of
// operand consists of, and how wide each part is.

#include <cstdint>

#include "vm/image/values.h"

namespace morphbus::vm {

class VerifiedProgram;
struct FunctionInfo;

/// A part of an operand; vm/image/operands.def says what each stands for. kNone stands for none.
enum class OperandPart : uint8_t {
#define PART(name, ...) name,
#include "vm/image/operands.def"
#undef PART
};

/// The bytes that each part takes, in the order of the enumerators.
inline constexpr uint8_t kPartBytes[] = {
#define PART(name, bytes, ...) bytes,
#include "vm/image/operands.def"
#undef PART
};
/// How many parts there are.
inline constexpr int kNumParts = sizeof kPartBytes;

/// The bytes that a part takes.
constexpr uint32_t BytesOf(OperandPart part) { return kPartBytes[static_cast<int>(part)]; }

/// A part as people read it; only listings and docs/vm.md need it.
struct PartWords {
  /// What docs/vm.md calls it.
  const char* word;
  /// What listings write between it and the part before it.
  const char* before;
  /// What listings write before its number; empty where they have a name for what it names.
  const char* noun;
};

/// The texts of each part, in the order of the enumerators.
inline constexpr PartWords kPartWords[] = {
#define PART(name, bytes, word, before, noun) {word, before, noun},
#include "vm/image/operands.def"
#undef PART
};

/// What the bytes after an opcode mean.
enum class OperandKind : uint8_t {
#define OPERAND(name, ...) name,
#include "vm/image/operands.def"
#undef OPERAND
};

/// The most parts that an operand has.
inline constexpr int kMostParts = 3;

/// What a kind of operand consists of.
struct OperandInfo {
  /// Its parts. Those that it does not have are kNone and stand last.
  OperandPart parts[kMostParts] = {};
  /// The bytes of all of them.
  uint8_t bytes = 0;

  /// From the parts that it has, in their order in the code.
  template <class... Parts>
  explicit consteval OperandInfo(Parts... all)
      : parts{all...}, bytes(static_cast<uint8_t>((0 + ... + BytesOf(all)))) {}
};

/// The parts of each kind, in the order of the enumerators.
inline constexpr OperandInfo kOperands[] = {
#define OPERAND(name, ...)           \
  [] {                               \
    using enum OperandPart;          \
    return OperandInfo(__VA_ARGS__); \
  }(),
#include "vm/image/operands.def"
#undef OPERAND
};

/// The row of a kind of operand.
constexpr const OperandInfo& InfoOf(OperandKind kind) { return kOperands[static_cast<int>(kind)]; }

/// Bytes that an operand takes.
constexpr uint32_t OperandBytes(OperandKind kind) { return InfoOf(kind).bytes; }

/// The number that stands in a part's bytes, without its sign: of two bytes the lower one comes
/// first. The reader of a signed byte widens it itself.
constexpr uint32_t NumberIn(OperandPart part, const uint8_t* at) {
  return BytesOf(part) == 2 ? at[0] | static_cast<uint32_t>(at[1]) << 8 : at[0];
}

/// The type of the value that a part names: of a local, a constant, a field, a label, a part of the
/// module; kVoid for a part that names no value. `at` are the part's bytes in the code of
/// `function`; what they name must exist.
ValueType TypeNamedBy(OperandPart part, const VerifiedProgram& program,
                      const FunctionInfo& function, const uint8_t* at);

/// The same for part `i` of the operand of this kind that stands at `at`.
ValueType TypeNamedBy(OperandKind kind, int i, const VerifiedProgram& program,
                      const FunctionInfo& function, const uint8_t* at);

}  // namespace morphbus::vm
