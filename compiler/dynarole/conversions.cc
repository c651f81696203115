#include "compiler/dynarole/conversions.h"

namespace morphbus::dynarole {

using source::Diagnostic;

void Conversions::Want(Expr* expr, Type wanted, const std::string& what) {
  // Nothing is said about what has been reported, or of what may still be found out.
  if (expr->type == Type::kError || wanted == Type::kError || wanted == Type::kUnknown) return;
  if (expr->type == Type::kUnknown) {
    Hint(expr, wanted);
    return;
  }
  // A conversion is noted in the tree; the generator and the folding carry it out.
  if (Fits(expr->type, wanted)) {
    if (expr->type != wanted) expr->wanted = wanted;
    return;
  }
  // The hint depends on the pair of types that people mix up.
  Diagnostic& error = pass_.Error(
      expr->span, what + " must be " + NameOf(wanted) + ", but this is " + NameOf(expr->type));
  if (expr->type == Type::kFloat && wanted == Type::kInt) {
    error.hint =
        "for an int write int(...), round(...) or floor(...), or make the other a float, by a "
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
  // One message about a value is enough, whoever else wants something of it.
  expr->type = Type::kError;
}

void Conversions::Hint(Expr* expr, Type type) {
  // A parameter takes the type that is wanted of it.
  if (expr->kind == ExprKind::kName && expr->meaning == Meaning::kLocal) {
    // Only members with a body have parameters.
    if (scope_.routine() == nullptr || scope_.routine()->signature < 0) return;
    Signature& signature = scope_.signature();
    const int slot = expr->index;
    if (slot < std::ssize(signature.parameters) &&
        pass_.Settle(&signature.parameters[slot], type)) {
      scope_.routine()->locals[slot] = type;
    }
    return;
  }
  // Of a choice both values are wanted to be what it is.
  if (expr->kind == ExprKind::kChoice) {
    for (size_t i = 1; i < expr->operands.size(); ++i) {
      if (expr->operands[i]->type == Type::kUnknown) Hint(expr->operands[i].get(), type);
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

}  // namespace morphbus::dynarole
