#pragma once
// The instruction set as data, generated from vm/image/opcodes.def.
// The .def file is the only list of instructions: enumerators, operands, costs, listings, the
// verifier's rows and the table in docs/vm.md all come from it.

#include <cstdint>

#include "vm/image/values.h"

namespace morphbus::vm {

/// One byte in the code of a function.
enum class Opcode : uint8_t {
#define OP(name, mnemonic, operand, pops, pushes, cost, effect, meaning) name,
#include "vm/image/opcodes.def"
#undef OP
};

/// How many there are; a byte from here on is no instruction.
inline constexpr int kNumOpcodes = 0
#define OP(name, mnemonic, operand, pops, pushes, cost, effect, meaning) +1
#include "vm/image/opcodes.def"
#undef OP
    ;

/// What the bytes after an opcode mean. Multi-byte operands are little-endian.
enum class OperandKind : uint8_t {
  kNone,
  /// A signed byte.
  kInt8,
  /// A u16 index into the constant table.
  kConstant,
  /// A u8 index of a local.
  kLocal,
  /// A u8 field slot of the function's role.
  kField,
  /// A u8 label slot of the function's role.
  kLabel,
  /// A u8 index into the keyword table.
  kKeyword,
  /// A u8 slot of a `function` of the function's role.
  kMethod,
  /// A u16 byte offset in the function.
  kTarget,
  /// A u8 role and a u8 slot of a command of it.
  kRoleCommand,
  /// A u16 number of a function.
  kFunction,
  /// A u8 role and a u8 slot of a field of it.
  kRoleField,
  /// A u16 index of a text in the constant table.
  kText,
  /// Two u8 indices of locals.
  kLocals,
  /// A u8 index of a local and a signed byte.
  kLocalInt8,
  /// A u8 index of a local, a u16 index into the constant table, and a u16 byte offset in the
  /// function.
  kLocalConstantTarget,
};

/// What an instruction may do; a function's effect is the strongest of all it may run.
/// Pure instructions only compute, those of a task act on the module, and those that wait may also
/// suspend the task.
enum class Effect : uint8_t { kPure, kTask, kWait };

/// One row of the instruction table, as machines read it. A program of a few kilobytes holds it, so
/// signatures are no longer than they must be.
struct OpcodeInfo {
  /// What the bytes behind the opcode mean.
  OperandKind operand;
  /// The letters of the types that it takes from the stack, deepest first
  /// (vm/image/value_types.def).
  char pops[4];
  /// The letter of the type that it leaves there, or none.
  char pushes[2];
  /// The units of the instruction budget that it costs.
  uint8_t cost;
  /// What it may do.
  Effect effect;
};

/// The same row as people read it; only listings and docs/vm.md need it.
struct OpcodeText {
  /// The name in listings.
  const char* mnemonic;
  /// The sentence for the table in docs/vm.md.
  const char* meaning;
};

/// The instruction table, by opcode.
inline constexpr OpcodeInfo kOpcodes[kNumOpcodes] = {
#define OP(name, mnemonic, operand, pops, pushes, cost, effect, meaning) \
  {OperandKind::operand, pops, pushes, cost, Effect::effect},
#include "vm/image/opcodes.def"
#undef OP
};
inline constexpr OpcodeText kOpcodeTexts[kNumOpcodes] = {
#define OP(name, mnemonic, operand, pops, pushes, cost, effect, meaning) {mnemonic, meaning},
#include "vm/image/opcodes.def"
#undef OP
};

/// The row of an opcode.
constexpr const OpcodeInfo& InfoOf(Opcode op) { return kOpcodes[static_cast<int>(op)]; }

/// Bytes that an operand takes.
constexpr uint32_t OperandBytes(OperandKind kind) {
  switch (kind) {
    case OperandKind::kNone:
      return 0;
    case OperandKind::kConstant:
    case OperandKind::kTarget:
    case OperandKind::kRoleCommand:
    case OperandKind::kFunction:
    case OperandKind::kRoleField:
    case OperandKind::kText:
    case OperandKind::kLocals:
    case OperandKind::kLocalInt8:
      return 2;
    case OperandKind::kLocalConstantTarget:
      return 5;
    default:
      return 1;
  }
}

/// A comparison that a function made: what a requirement measured, and what it wanted.
struct Comparison {
  /// One of kEqual to kLessEqualFloat; kPop if nothing was compared.
  Opcode opcode = Opcode::kPop;
  /// The type of both operands.
  ValueType type = ValueType::kVoid;
  Cell left, right;
};

/// What a function compared while it ran.
struct Comparisons {
  static constexpr int kMost = 8;
  /// In order; of more than kMost the first ones, and the last one in the last place.
  Comparison kept[kMost];
  /// How many there were.
  int count = 0;

  void Add(const Comparison& comparison) {
    kept[count < kMost ? count : kMost - 1] = comparison;
    ++count;
  }
  /// How many are in `kept`.
  [[nodiscard]] int num_kept() const { return count < kMost ? count : kMost; }
  /// The one that was made last; its opcode is kPop if there is none.
  [[nodiscard]] Comparison Last() const { return count == 0 ? Comparison() : kept[num_kept() - 1]; }
};

}  // namespace morphbus::vm
