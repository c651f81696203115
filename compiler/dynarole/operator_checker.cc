#include "compiler/dynarole/operator_checker.h"

#include <optional>

#include "compiler/dynarole/constants.h"

namespace morphbus::dynarole {

using source::Diagnostic;

Type OperatorChecker::InferUnary(Expr* expr) {
  Expr* operand = expr->operands[0].get();
  const Type type = operand->type;
  if (expr->op == Operator::kNot) {
    // Numbers and sets are no bools here, as they are in C.
    conversions_.Want(operand, Type::kBool, "the operand of '!'");
    return Type::kBool;
  }
  // What is not known yet may still turn out to be a number.
  if (type == Type::kError || type == Type::kUnknown || IsNumber(type)) return type;
  return pass_.Wrong(operand->span,
                     "the operand of '-' must be a number, but this is " + NameOf(type));
}

Type OperatorChecker::InferBinary(Expr* expr) {
  Expr* left = expr->operands[0].get();
  Expr* right = expr->operands[1].get();
  // Logic wants bools of its sides, whatever they are.
  const std::string sign = "'" + NameOf(expr->op) + "'";
  if (expr->op == Operator::kAnd || expr->op == Operator::kOr) {
    conversions_.Want(left, Type::kBool, "the left side of " + sign);
    conversions_.Want(right, Type::kBool, "the right side of " + sign);
    return Type::kBool;
  }
  // Of an operand that was reported nothing follows but the kind of the result.
  if (left->type == Type::kError || right->type == Type::kError) {
    return IsArithmetic(expr->op) ? Type::kError : Type::kBool;
  }
  // A parameter beside a number is one, if nothing better is known about it.
  if (pass_.phase() == Phase::kDefaults && left->type == Type::kUnknown)
    conversions_.Hint(left, right->type);
  if (pass_.phase() == Phase::kDefaults && right->type == Type::kUnknown)
    conversions_.Hint(right, left->type);
  return IsArithmetic(expr->op) ? InferArithmetic(expr) : InferComparison(expr);
}

Type OperatorChecker::InferArithmetic(Expr* expr) {
  Expr* left = expr->operands[0].get();
  Expr* right = expr->operands[1].get();
  const bool direction = left->type == Type::kDirection || right->type == Type::kDirection;
  // A sum is the one operator that directions have.
  if (direction && expr->op == Operator::kAdd) return InferDiagonal(expr);
  for (Expr* operand : {left, right}) {
    // Sets count in sums as they do in comparisons.
    if (IsSet(operand->type)) operand->wanted = Type::kInt;
    const Type type = operand->wanted == Type::kInt ? Type::kInt : operand->type;
    if (IsNumber(type) || type == Type::kUnknown) continue;
    return pass_.Wrong(operand->span, "the operands of '" + NameOf(expr->op) +
                                          "' must be numbers, but this is " + NameOf(type));
  }
  // The sum is an int if both operands are; an operand that is not known yet decides later.
  const Type a = IsSet(left->type) ? Type::kInt : left->type;
  const Type b = IsSet(right->type) ? Type::kInt : right->type;
  if (a == Type::kUnknown || b == Type::kUnknown) {
    return a == Type::kFloat || b == Type::kFloat ? Type::kFloat : Type::kUnknown;
  }
  // An int beside a float is converted, and the result is a float.
  if (a != b) (a == Type::kFloat ? right : left)->wanted = Type::kFloat;
  return a == b ? a : Type::kFloat;
}

Type OperatorChecker::InferDiagonal(Expr* expr) {
  for (ExprPtr& operand : expr->operands) {
    // A parameter beside a direction can be nothing else.
    if (operand->type == Type::kUnknown) conversions_.Hint(operand.get(), Type::kDirection);
    conversions_.Want(operand.get(), Type::kDirection, "the operands of '+' beside a direction");
    if (operand->type == Type::kError) return Type::kError;
  }
  // Directions that are known now need not wait for the fault.
  if (Fold(*expr).fault == vm::FaultCode::kNotPerpendicular) {
    return pass_.Wrong(
        expr->span, "these directions are not square to each other",
        "a diagonal is a sum of two or three of $NORTH or $SOUTH, $UP or $DOWN, $EAST or "
        "$WEST");
  }
  return Type::kDirection;
}

Type OperatorChecker::InferComparison(Expr* expr) {
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
    if (equality && a != Type::kUnknown && !IsNumber(a)) conversions_.Hint(right, a);
    if (equality && b != Type::kUnknown && !IsNumber(b)) conversions_.Hint(left, b);
    return Type::kBool;
  }
  // Otherwise both sides need one type, and an order only numbers have.
  const std::optional<Type> joined = Join(a, b);
  const bool comparable =
      joined && *joined != Type::kVoid && !IsSet(*joined) && (equality || IsNumber(*joined));
  if (!comparable) {
    Diagnostic& error =
        pass_.Error(expr->name_span, "cannot compare " + NameOf(a) + " with " + NameOf(b) +
                                         " by '" + NameOf(expr->op) + "'");
    if (IsSet(a) && IsSet(b)) {
      error.hint = scope_.IsNeighbour(*left) || scope_.IsNeighbour(*right)
                       ? "compare fields that neighbours share: n.NAME == m.NAME"
                       : "compare sizes: sizeof(...) == sizeof(...)";
    }
    if (joined && !equality && !IsSet(a)) error.hint = "only numbers have an order";
    return Type::kBool;
  }
  // The narrower side is converted: an int beside a float, $ANY beside a direction or axis.
  if (a != *joined) left->wanted = *joined;
  if (b != *joined) right->wanted = *joined;
  return Type::kBool;
}

Type OperatorChecker::InferChoice(Expr* expr) {
  conversions_.Want(expr->operands[0].get(), Type::kBool, "the condition of '?'");
  Expr* first = expr->operands[1].get();
  Expr* second = expr->operands[2].get();
  if (first->type == Type::kError || second->type == Type::kError) return Type::kError;
  // A parameter beside a value is of its type, if nothing better is known about it.
  if (pass_.phase() == Phase::kDefaults && first->type == Type::kUnknown)
    conversions_.Hint(first, second->type);
  if (pass_.phase() == Phase::kDefaults && second->type == Type::kUnknown)
    conversions_.Hint(second, first->type);
  if (first->type == Type::kUnknown || second->type == Type::kUnknown) {
    return first->type == Type::kUnknown ? second->type : first->type;
  }
  std::optional<Type> joined = Join(first->type, second->type);
  if (joined == Type::kAny) joined = Type::kDirection;
  // A set of joints beside a joint stands for the one in it.
  if (!joined && Fits(first->type, second->type)) joined = second->type;
  if (!joined && Fits(second->type, first->type)) joined = first->type;
  if (joined == Type::kVoid) {
    return pass_.Wrong(first->span, "a choice is between values, and this has none",
                       "to do one of two things write if (...) { ... } else { ... }");
  }
  if (!joined) {
    return pass_.Wrong(expr->name_span,
                       "the values of a choice must be of one type, but these are " +
                           NameOf(first->type) + " and " + NameOf(second->type));
  }
  for (Expr* value : {first, second}) {
    if (value->type != *joined) value->wanted = *joined;
  }
  return *joined;
}

void OperatorChecker::CompareSizes(Expr* set, Expr* other) {
  // The size is an int, and becomes a float beside one, as any int does.
  set->wanted = other->type == Type::kFloat ? Type::kFloat : Type::kInt;
  if (other->type == Type::kUnknown) conversions_.Hint(other, Type::kInt);
}

}  // namespace morphbus::dynarole
