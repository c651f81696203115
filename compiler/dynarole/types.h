#pragma once
// Static types of DynaRole.

#include <cstdint>
#include <optional>
#include <string_view>

#include "vm/values.h"

namespace morphbus::dynarole {

enum class Type : uint8_t {
  kUnknown,  ///< Not found out yet.
  kError,    ///< Reported already; fits everything.
  kVoid,
  kBool,
  kInt,
  kFloat,
  kDirection,
  kAxis,
  kAny,  ///< `$ANY` by itself: a direction or an axis, as wanted.
  kRole,
  kJoint,
  kLink,
  kSet,
  kConnector,
  kJointSet,
  kLinkSet,
};

/// As messages name it: "an int", "a direction", "a set of modules".
const char* NameOf(Type type);

/// The type that stands before a parameter's name, such as `float`.
std::optional<Type> TypeFromName(std::string_view name);

/// How values of the type are stored; kVoid for types without values.
vm::ValueType ValueTypeOf(Type type);

/// The type that both fit into, if there is one: an int and a float are a float, `$ANY` takes the
/// other's type, kUnknown and kError give way.
std::optional<Type> Join(Type a, Type b);

/// True if a value of type `from` may stand where `to` is wanted (int for float, `$ANY`, a set of
/// joints for the one joint in it).
bool Fits(Type from, Type to);

constexpr bool IsNumber(Type type) { return type == Type::kInt || type == Type::kFloat; }
constexpr bool IsSet(Type type) {
  return type == Type::kSet || type == Type::kJointSet || type == Type::kLinkSet;
}

}  // namespace morphbus::dynarole
