#pragma once
// Operators: arithmetic, comparisons, logic, diagonals of directions.

#include "compiler/dynarole/conversions.h"

namespace morphbus::dynarole {

/// Finds the types of expressions with an operator, whose operands have been given theirs.
class OperatorChecker {
 public:
  /// All arguments must outlive it.
  OperatorChecker(Scope* scope, Conversions* conversions, CheckPass* pass)
      : scope_(*scope), conversions_(*conversions), pass_(*pass) {}

  /// `-x` has the type of x; `!x` is a bool.
  Type InferUnary(Expr* expr);
  /// Arithmetic has the wider of the types of its sides; comparisons and logic are bools.
  Type InferBinary(Expr* expr);
  /// `c ? x : y` has the type that both values fit into.
  Type InferChoice(Expr* expr);

 private:
  Type InferArithmetic(Expr* expr);
  /// `$NORTH + $UP`: what is known now must be a direction; the rest is a fault later.
  Type InferDiagonal(Expr* expr);
  /// Comparisons are bools, whatever is wrong with their sides, so that one slip causes no second
  /// message.
  Type InferComparison(Expr* expr);
  /// Makes `set` stand for its size beside the number `other`.
  void CompareSizes(Expr* set, Expr* other);

  Scope& scope_;
  Conversions& conversions_;
  CheckPass& pass_;
};

}  // namespace morphbus::dynarole
