#pragma once
// Static types of DynaRole: what the compiler knows of a value before the program runs. Types are
// found, not written (docs/dynarole.md, Types).

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "vm/image/opcodes.h"

namespace morphbus::dynarole {

/// What the checker knows of an expression. The types that have values are numbered as the virtual
/// machine numbers them, so that one is turned into the other by a cast.
enum class Type : uint8_t {
#define VALUE_TYPE(name, letter, word, phrase) name,
#include "vm/image/value_types.def"
#undef VALUE_TYPE
  kAny,      ///< `$ANY` by itself: a direction or an axis, as wanted.
  kUnknown,  ///< Not found out yet.
  kError,    ///< Reported already; fits everything.
};

/// The type as messages name it, with its article: "an int", "a direction", "a set of modules".
std::string NameOf(Type type);

/// The type in one word, "float"; empty for what is not known or was reported.
std::string WordOf(Type type);

/// The type that stands before a parameter's name, such as `float`.
std::optional<Type> TypeFromName(std::string_view name);

/// How values of the type are stored: `$ANY` as a direction; kVoid for types without values.
vm::ValueType ValueTypeOf(Type type);

/// The type that a letter of vm/image/opcodes.def stands for.
constexpr Type TypeOfLetter(char letter) { return static_cast<Type>(vm::TypeOfLetter(letter)); }

/// The type of what an instruction pushes, if that is the same whatever its operand; else kVoid.
constexpr Type TypePushedBy(vm::Opcode op) {
  return static_cast<Type>(vm::InfoOf(op).pushes[0].type());
}

/// The type that both fit into, if there is one: an int and a float are a float, `$ANY` takes the
/// other's type, kUnknown and kError give way.
std::optional<Type> Join(Type a, Type b);

/// True if a value of type `from` may stand where `to` is wanted (int for float, `$ANY`, a set of
/// joints for the one joint in it).
bool Fits(Type from, Type to);

/// Whether values of the type can be computed with.
constexpr bool IsNumber(Type type) { return type == Type::kInt || type == Type::kFloat; }
/// Whether values of the type have members that sizeof counts.
constexpr bool IsSet(Type type) {
  return type == Type::kSet || type == Type::kJointSet || type == Type::kLinkSet;
}

}  // namespace morphbus::dynarole
