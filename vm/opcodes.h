#pragma once
// The instruction set as data, generated from vm/opcodes.def.

#include <cstdint>

#include "vm/values.h"

namespace morphbus::vm {

enum class Opcode : uint8_t {
#define OP(name, mnemonic, operand, pops, pushes, cost, effect, meaning) name,
#include "vm/opcodes.def"
#undef OP
};

inline constexpr int kNumOpcodes = 0
#define OP(name, mnemonic, operand, pops, pushes, cost, effect, meaning) +1
#include "vm/opcodes.def"
#undef OP
    ;

/// What the bytes after an opcode mean. Multi-byte operands are little-endian.
enum class OperandKind : uint8_t {
  kNone,
  kInt8,         ///< Signed byte.
  kConstant,     ///< u16 index into the constant table.
  kLocal,        ///< u8 index of a local.
  kField,        ///< u8 field slot of the function's role.
  kLabel,        ///< u8 label slot of the function's role.
  kKeyword,      ///< u8 index into the keyword table.
  kMethod,       ///< u8 slot of a `function` of the function's role.
  kTarget,       ///< u16 byte offset in the function.
  kRoleCommand,  ///< u8 role, u8 command slot.
};

/// What an instruction may do; a function's effect is the strongest of all it may run.
enum class Effect : uint8_t { kPure, kTask, kWait };

struct OpcodeInfo {
  const char* mnemonic;
  OperandKind operand;
  const char* pops;
  const char* pushes;
  int cost;
  Effect effect;
  const char* meaning;
};

inline constexpr OpcodeInfo kOpcodes[kNumOpcodes] = {
#define OP(name, mnemonic, operand, pops, pushes, cost, effect, meaning) \
  {mnemonic, OperandKind::operand, pops, pushes, cost, Effect::effect, meaning},
#include "vm/opcodes.def"
#undef OP
};

constexpr const OpcodeInfo& InfoOf(Opcode op) { return kOpcodes[static_cast<int>(op)]; }

/// Bytes that an operand takes.
constexpr uint32_t OperandBytes(OperandKind kind) {
  switch (kind) {
    case OperandKind::kNone:
      return 0;
    case OperandKind::kConstant:
    case OperandKind::kTarget:
    case OperandKind::kRoleCommand:
      return 2;
    default:
      return 1;
  }
}

/// The type that a letter of the table's signatures stands for; kVoid for anything else.
constexpr ValueType TypeOfLetter(char letter) {
  switch (letter) {
    case 'b':
      return ValueType::kBool;
    case 'i':
      return ValueType::kInt;
    case 'f':
      return ValueType::kFloat;
    case 'd':
      return ValueType::kDirection;
    case 'a':
      return ValueType::kAxis;
    case 'r':
      return ValueType::kRole;
    case 'j':
      return ValueType::kJoint;
    case 'l':
      return ValueType::kLink;
    case 's':
      return ValueType::kSet;
    case 'c':
      return ValueType::kConnector;
    case 'J':
      return ValueType::kJointSet;
    case 'L':
      return ValueType::kLinkSet;
    default:
      return ValueType::kVoid;
  }
}

}  // namespace morphbus::vm
