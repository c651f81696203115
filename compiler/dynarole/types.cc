#include "compiler/dynarole/types.h"

namespace morphbus::dynarole {

const char* NameOf(Type type) {
  switch (type) {
    case Type::kUnknown:
      return "a value of unknown type";
    case Type::kError:
      return "an error";
    case Type::kVoid:
      return "nothing";
    case Type::kBool:
      return "a bool";
    case Type::kInt:
      return "an int";
    case Type::kFloat:
      return "a float";
    case Type::kDirection:
      return "a direction";
    case Type::kAxis:
      return "an axis";
    case Type::kAny:
      return "$ANY";
    case Type::kRole:
      return "a role";
    case Type::kJoint:
      return "a joint";
    case Type::kLink:
      return "a link";
    case Type::kSet:
      return "a set of modules";
    case Type::kConnector:
      return "a connector";
    case Type::kJointSet:
      return "a set of joints";
    case Type::kLinkSet:
      return "a set of links";
  }
  return "?";
}

std::optional<Type> TypeFromName(std::string_view name) {
  if (name == "bool") return Type::kBool;
  if (name == "int") return Type::kInt;
  if (name == "float") return Type::kFloat;
  if (name == "direction") return Type::kDirection;
  if (name == "axis") return Type::kAxis;
  if (name == "role") return Type::kRole;
  if (name == "joint") return Type::kJoint;
  if (name == "link") return Type::kLink;
  return std::nullopt;
}

vm::ValueType ValueTypeOf(Type type) {
  switch (type) {
    case Type::kBool:
      return vm::ValueType::kBool;
    case Type::kInt:
      return vm::ValueType::kInt;
    case Type::kFloat:
      return vm::ValueType::kFloat;
    case Type::kDirection:
    case Type::kAny:
      return vm::ValueType::kDirection;
    case Type::kAxis:
      return vm::ValueType::kAxis;
    case Type::kRole:
      return vm::ValueType::kRole;
    case Type::kJoint:
      return vm::ValueType::kJoint;
    case Type::kLink:
      return vm::ValueType::kLink;
    case Type::kSet:
      return vm::ValueType::kSet;
    case Type::kConnector:
      return vm::ValueType::kConnector;
    case Type::kJointSet:
      return vm::ValueType::kJointSet;
    case Type::kLinkSet:
      return vm::ValueType::kLinkSet;
    case Type::kUnknown:
    case Type::kError:
    case Type::kVoid:
      break;
  }
  return vm::ValueType::kVoid;
}

std::optional<Type> Join(Type a, Type b) {
  if (a == b || b == Type::kUnknown || b == Type::kError) return a;
  if (a == Type::kUnknown || a == Type::kError) return b;
  if (IsNumber(a) && IsNumber(b)) return Type::kFloat;
  const auto takes_any = [](Type type) { return type == Type::kDirection || type == Type::kAxis; };
  if (a == Type::kAny && takes_any(b)) return b;
  if (b == Type::kAny && takes_any(a)) return a;
  return std::nullopt;
}

bool Fits(Type from, Type to) {
  if (from == to) return true;
  if (from == Type::kError || to == Type::kError || from == Type::kUnknown ||
      to == Type::kUnknown) {
    return true;
  }
  if (from == Type::kInt) return to == Type::kFloat;
  if (from == Type::kAny) return to == Type::kDirection || to == Type::kAxis;
  if (from == Type::kJointSet) return to == Type::kJoint;
  if (from == Type::kLinkSet) return to == Type::kLink;
  return false;
}

}  // namespace morphbus::dynarole
