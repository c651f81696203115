#include "compiler/dynarole/types.h"

namespace morphbus::dynarole {

std::string NameOf(Type type) {
  // Types with values are called as everywhere (vm/image/value_types.def); the others are ours.
  if (type <= Type::kText) return vm::InfoOf(static_cast<vm::ValueType>(type)).phrase;
  if (type == Type::kAny) return "$ANY";
  return type == Type::kUnknown ? "a value of unknown type" : "an error";
}

std::string WordOf(Type type) {
  if (type <= Type::kText) return vm::InfoOf(static_cast<vm::ValueType>(type)).word;
  return type == Type::kAny ? "direction" : "";
}

std::optional<Type> TypeFromName(std::string_view name) {
  for (int type = static_cast<int>(Type::kBool); type <= static_cast<int>(Type::kLink); ++type) {
    if (name == vm::kValueTypes[type].word) return static_cast<Type>(type);
  }
  if (name == vm::InfoOf(vm::ValueType::kConnector).word) return Type::kConnector;
  return std::nullopt;
}

vm::ValueType ValueTypeOf(Type type) {
  if (type == Type::kAny) return vm::ValueType::kDirection;
  return type > Type::kAny ? vm::ValueType::kVoid : static_cast<vm::ValueType>(type);
}

std::optional<Type> Join(Type a, Type b) {
  // What is not known, or was reported, gives way to what is known.
  if (a == b || b == Type::kUnknown || b == Type::kError) return a;
  if (a == Type::kUnknown || a == Type::kError) return b;
  if (IsNumber(a) && IsNumber(b)) return Type::kFloat;
  // $ANY is whatever stands beside it.
  const auto takes_any = [](Type type) { return type == Type::kDirection || type == Type::kAxis; };
  if (a == Type::kAny && takes_any(b)) return b;
  if (b == Type::kAny && takes_any(a)) return a;
  return std::nullopt;
}

bool Fits(Type from, Type to) {
  if (from == to) return true;
  // Of these nothing can be said; they cause no further message.
  if (from == Type::kError || to == Type::kError || from == Type::kUnknown ||
      to == Type::kUnknown) {
    return true;
  }
  // The conversions that the language has.
  if (from == Type::kInt) return to == Type::kFloat;
  if (from == Type::kAny) return to == Type::kDirection || to == Type::kAxis;
  if (from == Type::kJointSet) return to == Type::kJoint;
  if (from == Type::kLinkSet) return to == Type::kLink;
  return false;
}

}  // namespace morphbus::dynarole
