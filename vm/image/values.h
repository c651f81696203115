#pragma once
// Values that DynaRole programs compute with. Every value is one 32-bit cell; its static type is
// known to the compiler and proved again by the verifier.
// The verifier relies on the order of the enumerators: types that can travel with an invocation
// come first, up to kRole.

#include <cstdint>
#include <cstring>

#include "vm/image/directions.h"

namespace morphbus::vm {

/// The static type of a value; vm/image/value_types.def says what each stands for.
enum class ValueType : uint8_t {
#define VALUE_TYPE(name, letter, word, phrase) name,
#include "vm/image/value_types.def"
#undef VALUE_TYPE
};

/// What vm/image/value_types.def says of a type: its letter in signatures, its name in programs,
/// and the words for it in messages.
struct ValueTypeInfo {
  /// The letter that stands for the type in vm/image/opcodes.def; '\0' for none.
  char letter;
  /// The type's name in listings.
  const char* word;
  /// How a message speaks of a value of the type: "a bool".
  const char* phrase;
};

/// What is known of each type, in the order of the enumerators.
inline constexpr ValueTypeInfo kValueTypes[] = {
#define VALUE_TYPE(name, letter, word, phrase) {letter, word, phrase},
#include "vm/image/value_types.def"
#undef VALUE_TYPE
};
/// How many types there are; a larger number in an image is none.
inline constexpr int kNumValueTypes = sizeof kValueTypes / sizeof kValueTypes[0];

/// The row of a type.
constexpr const ValueTypeInfo& InfoOf(ValueType type) {
  return kValueTypes[static_cast<int>(type)];
}

/// The type that a letter of an instruction's signature stands for; kVoid for anything else. The
/// search through a dozen rows is no burden, as no running program does it.
constexpr ValueType TypeOfLetter(char letter) {
  for (int i = 0; i < kNumValueTypes; ++i) {
    if (letter != '\0' && kValueTypes[i].letter == letter) return static_cast<ValueType>(i);
  }
  return ValueType::kVoid;
}

/// One value, whatever its type: an int, a float's bits, 0 or 1, an index or a mask.
/// It is the unit of the stack, of fields and of constants.
struct Cell {
  /// What the cell holds; the type says how to read it. Floats are IEEE 754 singles.
  uint32_t bits = 0;

  // Cells of a given type are made by the functions below. Those that begin with As give what a
  // cell holds if it is known to be of that type; nothing is checked.
  static Cell Int(int32_t v) { return Cell{static_cast<uint32_t>(v)}; }
  static Cell Bool(bool v) { return Cell{v ? 1u : 0u}; }
  /// The bits are copied, as a cast would round.
  static Cell Float(float v) {
    Cell c;
    std::memcpy(&c.bits, &v, 4);
    return c;
  }
  /// The same bits as a signed number (two's complement).
  [[nodiscard]] int32_t AsInt() const { return static_cast<int32_t>(bits); }
  /// Everything but 0 is true; the verifier lets only 0 and 1 in.
  [[nodiscard]] bool AsBool() const { return bits != 0; }
  [[nodiscard]] float AsFloat() const {
    float v;
    std::memcpy(&v, &bits, 4);
    return v;
  }
};

/// False for infinity and what is no number. By its bits: a comparison would be a call where the
/// processor has no floats.
inline bool IsFinite(float v) { return (Cell::Float(v).bits & 0x7f800000u) != 0x7f800000u; }

/// True if the cell is a value of that type: finite, in range, 0 or 1. Only types that can stand in
/// an image or travel with an invocation have such values; joints, links and sets never do.
bool IsValueOf(ValueType type, Cell cell, int num_roles);

}  // namespace morphbus::vm
