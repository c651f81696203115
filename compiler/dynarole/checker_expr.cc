#include <algorithm>

#include "compiler/dynarole/checker_impl.h"

namespace morphbus::dynarole {

using source::Diagnostic;

namespace {

struct NamedConstant {
  const char* name;
  Type type;
  int value;
};

constexpr NamedConstant kDirections[] = {
    {"ANY", Type::kAny, 0},
    {"NORTH", Type::kDirection, static_cast<int>(vm::Direction::kNorth)},
    {"SOUTH", Type::kDirection, static_cast<int>(vm::Direction::kSouth)},
    {"EAST", Type::kDirection, static_cast<int>(vm::Direction::kEast)},
    {"WEST", Type::kDirection, static_cast<int>(vm::Direction::kWest)},
    {"UP", Type::kDirection, static_cast<int>(vm::Direction::kUp)},
    {"DOWN", Type::kDirection, static_cast<int>(vm::Direction::kDown)},
    {"NORTH_SOUTH", Type::kAxis, static_cast<int>(vm::Axis::kNorthSouth)},
    {"UP_DOWN", Type::kAxis, static_cast<int>(vm::Axis::kUpDown)},
    {"EAST_WEST", Type::kAxis, static_cast<int>(vm::Axis::kEastWest)},
};

const NamedConstant* FindDirection(const std::string& name) {
  for (const NamedConstant& constant : kDirections) {
    if (name == constant.name) return &constant;
  }
  return nullptr;
}

bool IsArithmetic(Operator op) { return op >= Operator::kAdd && op <= Operator::kMod; }

}  // namespace

Type Checker::Infer(Expr* expr) {
  expr->wanted = Type::kUnknown;
  expr->meaning = Meaning::kNone;
  expr->type = InferUnconverted(expr);
  return expr->type;
}

Type Checker::InferUnconverted(Expr* expr) {
  switch (expr->kind) {
    case ExprKind::kInt:
      if (expr->integer > 2147483647) {
        Error(expr->span, "number does not fit an int").hint =
            "ints reach from -2147483648 to 2147483647";
        return Type::kError;
      }
      return Type::kInt;
    case ExprKind::kFloat:
      return Type::kFloat;
    case ExprKind::kBool:
      return Type::kBool;
    case ExprKind::kDollar:
      return InferDollar(expr);
    case ExprKind::kName:
      return InferName(expr);
    case ExprKind::kUnary:
      return InferUnary(expr);
    case ExprKind::kBinary:
      return InferBinary(expr);
    case ExprKind::kMember:
      return InferMember(expr);
    case ExprKind::kCall:
      return InferCall(expr);
    case ExprKind::kSelf:
      Error(expr->span, "'self' cannot stand alone").hint =
          "ask it something, for example self.connected";
      return Type::kError;
    case ExprKind::kError:
      break;
  }
  return Type::kError;
}

// Records what the expression is to be converted to, or why it cannot be.
void Checker::Want(Expr* expr, Type wanted, const std::string& what) {
  if (expr->type == Type::kError || wanted == Type::kError || wanted == Type::kUnknown) return;
  if (expr->type == Type::kUnknown) {
    Hint(expr, wanted);
    return;
  }
  if (Fits(expr->type, wanted)) {
    if (expr->type != wanted) expr->wanted = wanted;
    return;
  }
  Diagnostic& error = Error(
      expr->span, what + " must be " + NameOf(wanted) + ", but this is " + NameOf(expr->type));
  if (expr->type == Type::kFloat && wanted == Type::kInt) {
    error.hint = "a float never becomes an int";
  } else if (IsSet(expr->type) && IsNumber(wanted)) {
    error.hint = "for the number of its members write sizeof(...)";
  } else if (expr->type == Type::kDirection && wanted == Type::kAxis) {
    error.hint = "axes are $NORTH_SOUTH, $UP_DOWN, $EAST_WEST and $ANY";
  } else if (expr->type == Type::kAxis && wanted == Type::kDirection) {
    error.hint = "directions are $NORTH, $SOUTH, $EAST, $WEST, $UP, $DOWN and $ANY";
  } else if (IsSet(expr->type) && wanted == Type::kBool) {
    error.hint = "compare its size with a number, for example == 1";
  }
  expr->type = Type::kError;
}

// The surroundings of a parameter tell its type.
void Checker::Hint(Expr* expr, Type type) {
  if (expr->kind == ExprKind::kName && expr->meaning == Meaning::kLocal) {
    if (routine_ == nullptr || routine_->signature < 0) return;
    Signature& signature = model_.signatures[static_cast<size_t>(routine_->signature)];
    const auto slot = static_cast<size_t>(expr->index);
    if (slot < signature.parameters.size() && Settle(&signature.parameters[slot], type)) {
      routine_->locals[slot] = type;
    }
    return;
  }
  const bool passes_on =
      expr->kind == ExprKind::kUnary || (expr->kind == ExprKind::kBinary && IsArithmetic(expr->op));
  if (!passes_on || !IsNumber(type)) return;
  for (ExprPtr& operand : expr->operands) {
    if (operand->type == Type::kUnknown) Hint(operand.get(), type);
  }
}

Type Checker::InferName(Expr* expr) {
  if (Local* local = routine_ != nullptr ? FindLocal(expr->name) : nullptr) {
    local->used = true;
    expr->meaning = Meaning::kLocal;
    expr->index = local->slot;
    return routine_->locals[static_cast<size_t>(local->slot)];
  }
  const RoleModel& owner = model_.roles[static_cast<size_t>(role_)];
  for (size_t i = 0; i < owner.fields.size(); ++i) {
    FieldDecl& decl = model_.fields[static_cast<size_t>(owner.fields[i].decl)];
    if (decl.name != expr->name) continue;
    expr->meaning = Meaning::kField;
    expr->index = static_cast<int>(i);
    if (routine_ != nullptr) decl.read = true;
    return decl.type;
  }
  const int label = FindSlot(owner.labels, expr->name);
  if (label >= 0) {
    if (routine_ == nullptr) return Type::kVoid;
    if (!InTask()) {
      Error(expr->span, std::string("a ") + NameOf(routine_->kind) + " cannot use labels").hint =
          "labels are resolved after all requirements hold";
      return Type::kError;
    }
    expr->meaning = Meaning::kLabel;
    expr->index = label;
    const Routine& routine =
        model_.routines[static_cast<size_t>(owner.labels[static_cast<size_t>(label)].routine)];
    return routine.result == Type::kVoid ? Type::kUnknown : routine.result;
  }
  return UnknownName(expr);
}

// Says what the name may have meant: a name of another kind, one of a subrole, a slip.
Type Checker::UnknownName(Expr* expr) {
  const RoleModel& owner = model_.roles[static_cast<size_t>(role_)];
  if (owner.broken) return Type::kError;
  Diagnostic& error = Error(expr->span, "unknown name '" + expr->name + "'");
  if (FindDirection(expr->name) != nullptr) {
    error.hint = "did you mean '$" + expr->name + "'?";
    return Type::kError;
  }
  for (const Builtin& builtin : SelfBuiltins()) {
    if (expr->name == builtin.name) {
      error.hint = std::string("did you mean '") + builtin.usage + "'?";
      return Type::kError;
    }
  }
  if (FindSlot(owner.methods, expr->name) >= 0) {
    error.message = "function '" + expr->name + "' is not called";
    error.hint = "write " + expr->name + "(...)";
    return Type::kError;
  }
  if (model_.FindRole(expr->name) >= 0) {
    error.message = "role '" + expr->name + "' cannot stand here";
    error.hint = "as a value write '$" + expr->name + "'; to run a command write " + expr->name +
                 ".command()";
    return Type::kError;
  }
  for (const RoleModel& role : model_.roles) {
    for (const FieldSlot& slot : role.fields) {
      const FieldDecl& decl = model_.fields[static_cast<size_t>(slot.decl)];
      if (decl.name != expr->name ||
          !model_.IsA(static_cast<int>(&role - model_.roles.data()), role_)) {
        continue;
      }
      error.hint = "only its subrole '" + role.name +
                   "' has this field; declare it here too: " + expr->name + ";";
      error.notes.push_back({decl.span, "declared here"});
      return Type::kError;
    }
  }
  std::vector<std::string> names;
  for (const Local& local : locals_) names.push_back(local.name);
  for (const FieldSlot& slot : owner.fields) {
    names.push_back(model_.fields[static_cast<size_t>(slot.decl)].name);
  }
  for (const NamedSlot& slot : owner.labels) names.push_back(slot.name);
  Suggest(&error, expr->name, names);
  return Type::kError;
}

Type Checker::InferDollar(Expr* expr) {
  expr->meaning = Meaning::kConstant;
  if (const NamedConstant* constant = FindDirection(expr->name)) {
    expr->cell = vm::Cell::Int(constant->value);
    return constant->type;
  }
  const int role = model_.FindRole(expr->name);
  if (role >= 0) {
    expr->cell = vm::Cell::Int(role);
    return Type::kRole;
  }
  expr->meaning = Meaning::kNone;
  for (const vm::KeywordKind kind :
       {vm::KeywordKind::kLink, vm::KeywordKind::kJoint, vm::KeywordKind::kConnector}) {
    const int keyword = keywords_.Find(kind, expr->name);
    if (keyword >= 0) return UseKeyword(expr, keyword);
  }
  Diagnostic& error = Error(expr->span, "unknown name '$" + expr->name + "'");
  if (expr->name == "Module") {
    error.message = "'$Module' is no value";
    error.hint = "every module plays Module; leave it out";
    return Type::kError;
  }
  std::vector<std::string> names;
  for (const NamedConstant& constant : kDirections) names.emplace_back(constant.name);
  for (const RoleModel& other : model_.roles) names.push_back(other.name);
  for (const Keyword& keyword : keywords_.all()) {
    if (keyword.kind == vm::KeywordKind::kLink) names.push_back(keyword.spelling);
  }
  std::string otherwise = "it is no direction, axis or role, nor a link of a module type given";
  if (keywords_.type_names.empty()) otherwise = "no module types were given";
  Suggest(&error, expr->name, names, "$", otherwise);
  return Type::kError;
}

Type Checker::UseKeyword(Expr* expr, int keyword) {
  const Keyword& entry = keywords_.all()[static_cast<size_t>(keyword)];
  auto& used = model_.keywords;
  auto it = std::find(used.begin(), used.end(), keyword);
  if (it == used.end()) {
    if (used.size() == vm::kMaxKeywords) {
      Error(expr->name_span, "too many keywords in one program").hint =
          "at most " + std::to_string(vm::kMaxKeywords);
      return Type::kError;
    }
    it = used.insert(used.end(), keyword);
  }
  expr->meaning = Meaning::kKeyword;
  expr->index = static_cast<int>(it - used.begin());
  switch (entry.kind) {
    case vm::KeywordKind::kLink:
      return Type::kLink;
    case vm::KeywordKind::kJoint:
      return Type::kJoint;
    default:
      return Type::kConnector;
  }
}

Type Checker::InferUnary(Expr* expr) {
  Expr* operand = expr->operands[0].get();
  // The sign of the smallest int belongs to its number.
  if (expr->op == Operator::kNegate && operand->kind == ExprKind::kInt) {
    operand->type = Type::kInt;
    operand->wanted = Type::kUnknown;
    return Type::kInt;
  }
  const Type type = Infer(operand);
  if (expr->op == Operator::kNot) {
    Want(operand, Type::kBool, "the operand of '!'");
    return Type::kBool;
  }
  if (type == Type::kError || type == Type::kUnknown || IsNumber(type)) return type;
  Error(operand->span,
        std::string("the operand of '-' must be a number, but this is ") + NameOf(type));
  return Type::kError;
}

Type Checker::InferBinary(Expr* expr) {
  Expr* left = expr->operands[0].get();
  Expr* right = expr->operands[1].get();
  Infer(left);
  Infer(right);
  const std::string sign = std::string("'") + NameOf(expr->op) + "'";
  if (expr->op == Operator::kAnd || expr->op == Operator::kOr) {
    Want(left, Type::kBool, "the left side of " + sign);
    Want(right, Type::kBool, "the right side of " + sign);
    return Type::kBool;
  }
  if (left->type == Type::kError || right->type == Type::kError) {
    return IsArithmetic(expr->op) ? Type::kError : Type::kBool;
  }
  // A parameter beside a number is one, if nothing better is known about it.
  if (phase_ == Phase::kDefaults && left->type == Type::kUnknown) Hint(left, right->type);
  if (phase_ == Phase::kDefaults && right->type == Type::kUnknown) Hint(right, left->type);
  return IsArithmetic(expr->op) ? InferArithmetic(expr) : InferComparison(expr);
}

Type Checker::InferArithmetic(Expr* expr) {
  Expr* left = expr->operands[0].get();
  Expr* right = expr->operands[1].get();
  for (Expr* operand : {left, right}) {
    // Sets count in sums as they do in comparisons.
    if (IsSet(operand->type)) operand->wanted = Type::kInt;
    const Type type = operand->wanted == Type::kInt ? Type::kInt : operand->type;
    if (IsNumber(type) || type == Type::kUnknown) continue;
    Error(operand->span, "the operands of '" + std::string(NameOf(expr->op)) +
                             "' must be numbers, but this is " + NameOf(type));
    return Type::kError;
  }
  const Type a = IsSet(left->type) ? Type::kInt : left->type;
  const Type b = IsSet(right->type) ? Type::kInt : right->type;
  if (a == Type::kUnknown || b == Type::kUnknown) {
    return a == Type::kFloat || b == Type::kFloat ? Type::kFloat : Type::kUnknown;
  }
  if (a != b) (a == Type::kFloat ? right : left)->wanted = Type::kFloat;
  return a == b ? a : Type::kFloat;
}

// A set compared with a number stands for its size.
void Checker::CompareSizes(Expr* set, Expr* other) {
  set->wanted = other->type == Type::kFloat ? Type::kFloat : Type::kInt;
  if (other->type == Type::kUnknown) Hint(other, Type::kInt);
}

Type Checker::InferComparison(Expr* expr) {
  Expr* left = expr->operands[0].get();
  Expr* right = expr->operands[1].get();
  const Type a = left->type;
  const Type b = right->type;
  const bool equality = expr->op == Operator::kEqual || expr->op == Operator::kNotEqual;
  if (IsSet(a) && (IsNumber(b) || b == Type::kUnknown)) {
    CompareSizes(left, right);
    return Type::kBool;
  }
  if (IsSet(b) && (IsNumber(a) || a == Type::kUnknown)) {
    CompareSizes(right, left);
    return Type::kBool;
  }
  if (a == Type::kUnknown || b == Type::kUnknown) {
    // Directions, axes, roles and bools have no other reading.
    if (equality && a != Type::kUnknown && !IsNumber(a)) Hint(right, a);
    if (equality && b != Type::kUnknown && !IsNumber(b)) Hint(left, b);
    return Type::kBool;
  }
  const std::optional<Type> joined = Join(a, b);
  const bool comparable = joined && *joined != Type::kVoid && *joined != Type::kConnector &&
                          !IsSet(*joined) && (equality || IsNumber(*joined));
  if (!comparable) {
    Diagnostic& error =
        Error(expr->name_span, std::string("cannot compare ") + NameOf(a) + " with " + NameOf(b) +
                                   " by '" + NameOf(expr->op) + "'");
    if (IsSet(a) && IsSet(b)) error.hint = "compare sizes: sizeof(...) == sizeof(...)";
    if (joined && !equality && !IsSet(a)) error.hint = "only numbers have an order";
    return Type::kBool;
  }
  if (a != *joined) left->wanted = *joined;
  if (b != *joined) right->wanted = *joined;
  return Type::kBool;
}

}  // namespace morphbus::dynarole
