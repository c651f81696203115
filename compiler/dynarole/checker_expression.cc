#include <algorithm>
#include <utility>

#include "compiler/dynarole/checker.h"
#include "compiler/dynarole/constants.h"

namespace morphbus::dynarole {

using source::Diagnostic;

namespace {

// The operators whose operands and result are numbers; the enumeration has them in a row.
bool IsArithmetic(Operator op) { return op >= Operator::kAdd && op <= Operator::kMod; }

}  // namespace

// The type found here is that of the value itself. Conversions are asked for by Want, later.
Type Checker::Infer(Expr* expr) {
  // An earlier pass may have known less, so nothing of it is kept.
  expr->wanted = Type::kUnknown;
  expr->meaning = Meaning::kNone;
  expr->type = InferUnconverted(expr);
  return expr->type;
}

Type Checker::InferUnconverted(Expr* expr) {
  switch (expr->kind) {
    case ExprKind::kInt:
      // The parser lets 2147483648 through for the sake of its negative.
      if (expr->integer > 2147483647) {
        return Wrong(expr->span, "number does not fit an int",
                     "ints reach from -2147483648 to 2147483647");
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
    case ExprKind::kSuper:
      return Wrong(expr->span, "'super' cannot stand alone",
                   "it calls what this member replaces, for example super.start()");
    case ExprKind::kText:
      return Wrong(expr->span, "a text can only be printed", "for example: print(\"knee at\", x);");
    case ExprKind::kSelf:
      return Wrong(expr->span, "'self' cannot stand alone",
                   "ask it something, for example self.connected");
    case ExprKind::kError:
      break;
  }
  return Type::kError;
}

// Records what the expression is to be converted to, or why it cannot be.
void Checker::Want(Expr* expr, Type wanted, const std::string& what) {
  // Nothing is said about what has been reported, or of what may still be found out.
  if (expr->type == Type::kError || wanted == Type::kError || wanted == Type::kUnknown) return;
  if (expr->type == Type::kUnknown) {
    Hint(expr, wanted);
    return;
  }
  if (Fits(expr->type, wanted)) {
    if (expr->type != wanted) expr->wanted = wanted;
    return;
  }
  // The hint depends on the pair of types that people mix up.
  Diagnostic& error = Error(
      expr->span, what + " must be " + NameOf(wanted) + ", but this is " + NameOf(expr->type));
  if (expr->type == Type::kFloat && wanted == Type::kInt) {
    error.hint =
        "a float never becomes an int, not by floor or round either: make the other a float, by a "
        "point in its first value (0.0)";
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
  // A parameter takes the type that is wanted of it.
  if (expr->kind == ExprKind::kName && expr->meaning == Meaning::kLocal) {
    if (routine_ == nullptr || routine_->signature < 0) return;
    Signature& signature = model_.signatures[routine_->signature];
    const int slot = expr->index;
    if (slot < std::ssize(signature.parameters) && Settle(&signature.parameters[slot], type)) {
      routine_->locals[slot] = type;
    }
    return;
  }
  // A sum of numbers wants of its operands what is wanted of it.
  const bool passes_on =
      expr->kind == ExprKind::kUnary || (expr->kind == ExprKind::kBinary && IsArithmetic(expr->op));
  if (!passes_on || !IsNumber(type)) return;
  for (ExprPtr& operand : expr->operands) {
    if (operand->type == Type::kUnknown) Hint(operand.get(), type);
  }
}

// A name alone is a variable, a field or a label; anything else is unknown, with a guess at what
// was meant.
Type Checker::InferName(Expr* expr) {
  // Variables and parameters hide fields, and fields hide labels.
  if (Local* local = routine_ != nullptr ? FindLocal(expr->name) : nullptr) {
    local->used = true;
    expr->meaning = Meaning::kLocal;
    expr->index = local->slot;
    return routine_->locals[local->slot];
  }
  const RoleModel& owner = Scope();
  if (const int slot = model_.FindField(owner, expr->name); slot >= 0) {
    expr->meaning = Meaning::kField;
    expr->index = slot;
    FieldDecl& decl = model_.fields[owner.fields[slot].decl];
    if (routine_ != nullptr) decl.read = true;
    return decl.type;
  }
  const int label = FindSlot(owner.labels, expr->name);
  if (label >= 0) {
    // A field's value cannot name a label; the caller says what it can be.
    if (routine_ == nullptr) return Type::kVoid;
    if (!InTask()) {
      return Wrong(expr->span, "a " + NameOf(routine_->kind) + " cannot use labels",
                   "labels are resolved after all requirements hold");
    }
    expr->meaning = Meaning::kLabel;
    expr->index = label;
    const Routine& routine = model_.routines[owner.labels[label].routine];
    return routine.result == Type::kVoid ? Type::kUnknown : routine.result;
  }
  // Constants of the role cannot share a name with the above; those outside all stand behind them.
  const int constant = model_.FindConstant(role_, expr->name);
  return constant >= 0 ? InferConstant(expr, constant) : UnknownName(expr);
}

// Says what the name may have meant: a name of another kind, one of a subrole, a slip.
Type Checker::UnknownName(Expr* expr) {
  // A role whose base is not known may inherit the name.
  const RoleModel& owner = Scope();
  if (owner.broken) return Type::kError;
  Diagnostic& error = Error(expr->span, "unknown name '" + expr->name + "'");
  if (FindDirection(expr->name) != nullptr) {
    error.hint = "did you mean '$" + expr->name + "'?";
    return Type::kError;
  }
  if (const std::string usages = UsagesOf(SelfBuiltins(), expr->name); !usages.empty()) {
    error.hint = "did you mean '" + usages + "'?";
    return Type::kError;
  }
  // Parts of the module type have their keywords behind a sign of their own.
  for (const auto& [kind, sign] :
       {std::pair(vm::KeywordKind::kJoint, "self."),
        std::pair(vm::KeywordKind::kConnector, "self."),
        std::pair(vm::KeywordKind::kSensor, "self."), std::pair(vm::KeywordKind::kLink, "$")}) {
    if (keywords_.Find(kind, expr->name) < 0) continue;
    error.hint = "did you mean '" + std::string(sign) + expr->name + "'?";
    return Type::kError;
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
  // Code of a base role often means a field that only its subroles declare.
  for (int r = 0; r < std::ssize(model_.roles); ++r) {
    const RoleModel& role = model_.roles[r];
    const int slot = model_.IsA(r, role_) ? model_.FindField(role, expr->name) : -1;
    if (slot < 0) continue;
    // One that all concrete subroles had would be known here.
    const RoleModel* without = nullptr;
    model_.FieldOfSubroles(role_, expr->name, &without);
    error.hint = "its subrole '" + role.name + "' has this field, but " +
                 (without != nullptr ? "'" + without->name + "' has not; give it one"
                                     : "'" + owner.name + "' itself can be taken") +
                 ", or declare it here: " + expr->name + ";";
    error.notes.push_back({model_.fields[role.fields[slot].decl].span, "declared here"});
    return Type::kError;
  }
  std::vector<std::string> names = NamesInScope();
  for (const NamedSlot& slot : owner.labels) names.push_back(slot.name);
  Suggest(&error, expr->name, names);
  return Type::kError;
}

std::vector<std::string> Checker::NamesInScope() const {
  std::vector<std::string> names;
  for (const Local& local : locals_) names.push_back(local.name);
  for (const FieldSlot& slot : Scope().fields) {
    names.push_back(model_.fields[slot.decl].name);
  }
  for (const ConstantModel& constant : model_.constants) {
    if (constant.role < 0 || model_.IsA(role_, constant.role)) names.push_back(constant.name);
  }
  return names;
}

// `$NAME` is a direction, an axis, a role or a part of the module, in that order.
Type Checker::InferDollar(Expr* expr) {
  expr->meaning = Meaning::kConstant;
  if (const NamedDirection* constant = FindDirection(expr->name)) {
    expr->cell = vm::Cell::Int(constant->value);
    return constant->type;
  }
  // A role of the program, then a part of the module.
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
  // It is nothing that is known.
  Diagnostic& error = Error(expr->span, "unknown name '$" + expr->name + "'");
  if (expr->name == "Module") {
    error.message = "'$Module' is no value";
    error.hint = "every module plays Module; leave it out";
    return Type::kError;
  }
  std::vector<std::string> names;
  for (const NamedDirection& constant : kDirections) names.emplace_back(constant.name);
  for (const RoleModel& other : model_.roles) names.push_back(other.name);
  for (const keywords::Keyword& keyword : keywords_.all()) {
    if (keyword.kind == vm::KeywordKind::kLink) names.push_back(keyword.spelling);
  }
  std::string otherwise = "it is no direction, axis or role, nor a link of a module type given";
  if (keywords_.empty()) otherwise = "no module types were given";
  Suggest(&error, expr->name, names, "$", otherwise);
  return Type::kError;
}

// Notes that the program needs this part, so that modules without it do not take the role.
Type Checker::UseKeyword(Expr* expr, int keyword) {
  const keywords::Keyword& entry = keywords_.all()[keyword];
  // The image lists each keyword once, in the order of their first use.
  auto& used = model_.keywords;
  auto it = std::find(used.begin(), used.end(), keyword);
  if (it == used.end()) {
    if (used.size() == vm::kMaxKeywords) {
      return Wrong(expr->name_span, "too many keywords in one program",
                   "at most " + std::to_string(vm::kMaxKeywords));
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

// `-x` has the type of x; `!x` is a bool.
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
  return Wrong(operand->span, "the operand of '-' must be a number, but this is " + NameOf(type));
}

Type Checker::InferBinary(Expr* expr) {
  Expr* left = expr->operands[0].get();
  Expr* right = expr->operands[1].get();
  // Both sides are looked at first, so that each is checked whatever the other is.
  Infer(left);
  Infer(right);
  const std::string sign = "'" + NameOf(expr->op) + "'";
  if (expr->op == Operator::kAnd || expr->op == Operator::kOr) {
    Want(left, Type::kBool, "the left side of " + sign);
    Want(right, Type::kBool, "the right side of " + sign);
    return Type::kBool;
  }
  // Of an operand that was reported nothing follows but the kind of the result.
  if (left->type == Type::kError || right->type == Type::kError) {
    return IsArithmetic(expr->op) ? Type::kError : Type::kBool;
  }
  // A parameter beside a number is one, if nothing better is known about it.
  if (phase_ == Phase::kDefaults && left->type == Type::kUnknown) Hint(left, right->type);
  if (phase_ == Phase::kDefaults && right->type == Type::kUnknown) Hint(right, left->type);
  return IsArithmetic(expr->op) ? InferArithmetic(expr) : InferComparison(expr);
}

// `$NORTH + $UP`: a diagonal. What is known now must be a direction; the rest is a fault later.
Type Checker::InferDiagonal(Expr* expr) {
  for (ExprPtr& operand : expr->operands) {
    if (operand->type == Type::kUnknown) Hint(operand.get(), Type::kDirection);
    Want(operand.get(), Type::kDirection, "the operands of '+' beside a direction");
    if (operand->type == Type::kError) return Type::kError;
  }
  if (Fold(*expr).fault == vm::FaultCode::kNotPerpendicular) {
    return Wrong(expr->span, "these directions are not square to each other",
                 "a diagonal is a sum of two or three of $NORTH or $SOUTH, $UP or $DOWN, $EAST or "
                 "$WEST");
  }
  return Type::kDirection;
}

Type Checker::InferArithmetic(Expr* expr) {
  Expr* left = expr->operands[0].get();
  Expr* right = expr->operands[1].get();
  const bool direction = left->type == Type::kDirection || right->type == Type::kDirection;
  if (direction && expr->op == Operator::kAdd) return InferDiagonal(expr);
  for (Expr* operand : {left, right}) {
    // Sets count in sums as they do in comparisons.
    if (IsSet(operand->type)) operand->wanted = Type::kInt;
    const Type type = operand->wanted == Type::kInt ? Type::kInt : operand->type;
    if (IsNumber(type) || type == Type::kUnknown) continue;
    return Wrong(operand->span, "the operands of '" + NameOf(expr->op) +
                                    "' must be numbers, but this is " + NameOf(type));
  }
  // The sum is an int if both operands are; an operand that is not known yet decides later.
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

// Comparisons are bools, whatever is wrong with their sides, so that one slip causes no second
// message.
Type Checker::InferComparison(Expr* expr) {
  Expr* left = expr->operands[0].get();
  Expr* right = expr->operands[1].get();
  const Type a = left->type;
  const Type b = right->type;
  const bool equality = expr->op == Operator::kEqual || expr->op == Operator::kNotEqual;
  // A set on one side, a number on the other: sizes are compared.
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
  // Otherwise both sides need one type, and an order only numbers have.
  const std::optional<Type> joined = Join(a, b);
  const bool comparable =
      joined && *joined != Type::kVoid && !IsSet(*joined) && (equality || IsNumber(*joined));
  if (!comparable) {
    Diagnostic& error = Error(expr->name_span, "cannot compare " + NameOf(a) + " with " +
                                                   NameOf(b) + " by '" + NameOf(expr->op) + "'");
    if (IsSet(a) && IsSet(b)) error.hint = "compare sizes: sizeof(...) == sizeof(...)";
    if (joined && !equality && !IsSet(a)) error.hint = "only numbers have an order";
    return Type::kBool;
  }
  // The narrower side is converted: an int beside a float, $ANY beside a direction or axis.
  if (a != *joined) left->wanted = *joined;
  if (b != *joined) right->wanted = *joined;
  return Type::kBool;
}

}  // namespace morphbus::dynarole
