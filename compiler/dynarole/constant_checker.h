#pragma once
// Constants: `const NAME = VALUE;`, whose values are known at compile time, and parameters, which
// are constants to the program and have a range: `param NAME = VALUE in [LEAST, MOST];`.

#include <functional>
#include <optional>

#include "compiler/dynarole/constants.h"
#include "compiler/dynarole/scope.h"

namespace morphbus::dynarole {

/// Computes constants, each after those that it rests on, which may stand behind it.
class ConstantChecker {
 public:
  /// `infer` finds the type of an expression, and hands the constants that it names back to Infer.
  /// All arguments must outlive the checker.
  ConstantChecker(ProgramModel* model, Scope* scope, CheckPass* pass,
                  std::function<Type(Expr*)> infer)
      : model_(*model), scope_(*scope), pass_(*pass), infer_(std::move(infer)) {}

  /// Computes all of them, before any other expression is looked at. Constants rest on nothing but
  /// each other, so one pass, the final one, is enough.
  void CheckAll();
  /// The type of a constant or parameter where it is named, and the value of a constant.
  Type Infer(Expr* expr, int index);

 private:
  /// Computes one, unless that was done; its type is kError if that fails, which has been reported
  /// then.
  void Resolve(int index);
  /// The value that an expression of a constant comes to. None if it has none, which is reported.
  std::optional<Constant> Evaluate(const ConstantModel& constant, Expr* expr);
  /// The value and the range of a parameter, all of one type.
  void ResolveParameter(ConstantModel* parameter);

  ProgramModel& model_;
  Scope& scope_;
  CheckPass& pass_;
  std::function<Type(Expr*)> infer_;
  int depth_ = 0;  ///< Constants that are being computed, each for the one before.
};

}  // namespace morphbus::dynarole
