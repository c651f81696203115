#pragma once
// What gives variables and fields their values: declarations and assignments.

#include "compiler/dynarole/expression_checker.h"

namespace morphbus::dynarole {

/// Checks the declarations and assignments of the routine that the scope is in.
class AssignmentChecker {
 public:
  /// All arguments must outlive it.
  AssignmentChecker(ProgramModel* model, Scope* scope, ExpressionChecker* expressions,
                    CheckPass* pass)
      : model_(*model), scope_(*scope), expressions_(*expressions), pass_(*pass) {}

  /// `var NAME = VALUE;` declares a local, whose type is that of the value.
  void CheckVar(Stmt* statement);
  /// `NAME = VALUE;`, `NAME[2] = VALUE;`, `NAME += VALUE;` and the like.
  void CheckAssign(Stmt* statement);

 private:
  /// `var NAME = [VALUE, VALUE];` and `var NAME[8] = VALUE;`
  void CheckArray(Stmt* statement);
  /// Finds what is assigned to, a variable, parameter or field, whose type is `type` if that of a
  /// parameter is not known yet; false if it is neither.
  bool FindTarget(Stmt* statement, Type type);
  /// Reports a number behind the name of what is no array.
  void CheckSubscript(Stmt* statement);
  /// Reports what is neither: perhaps a constant, a label, a slip.
  void UnknownTarget(const Stmt& statement);

  ProgramModel& model_;
  Scope& scope_;
  ExpressionChecker& expressions_;
  CheckPass& pass_;
};

}  // namespace morphbus::dynarole
