#pragma once
// Statements: the bodies of startups, behaviors, commands, handlers and functions.

#include "compiler/dynarole/assignment_checker.h"
#include "compiler/dynarole/expression_checker.h"

namespace morphbus::dynarole {

/// Checks the statements of the routine that the scope is in.
class StatementChecker {
 public:
  /// All arguments must outlive it.
  StatementChecker(ProgramModel* model, Scope* scope, ExpressionChecker* expressions,
                   CheckPass* pass)
      : model_(*model),
        scope_(*scope),
        expressions_(*expressions),
        pass_(*pass),
        assignments_(model, scope, expressions, pass) {}

  /// Checks a block, which is a scope of its own, and warns of what is never reached in it.
  void CheckBlock(Stmt* block);

 private:
  void CheckStatement(Stmt* statement);
  /// The same with a scope of its own, as branches and bodies have also without braces.
  void CheckScoped(Stmt* statement);
  /// A return settles the type of the routine's result, or must fit it.
  void CheckReturn(Stmt* statement);
  void CheckExprStatement(Stmt* statement);
  /// A loop with a head of its own, whose variable ends with it.
  void CheckFor(Stmt* statement);
  /// A loop over the neighbours of a set.
  void CheckForEach(Stmt* statement);
  /// The type of what the loop goes over; an array, which is counted through, gets a hint.
  Type InferSet(Expr* set);
  /// What is looked at and the values of its cases are of one type, and each value leads to one
  /// block.
  void CheckSwitch(Stmt* statement);
  void CheckCases(Stmt* statement, Type type);
  /// Warns of values of an enumeration that a switch without `default` leaves out.
  void CheckLeftOut(const Stmt& statement);
  /// `break` stands in a loop or a switch, `continue` in a loop.
  void CheckLeave(const Stmt& statement);
  /// Only a bool is a condition: no number and no set stands for one. `word` is that of the
  /// statement, "if" or "while", for the message.
  void CheckCondition(Expr* condition, const char* word);

  ProgramModel& model_;
  Scope& scope_;
  ExpressionChecker& expressions_;
  CheckPass& pass_;
  AssignmentChecker assignments_;
  int loops_ = 0;     ///< Loops around the statement being checked.
  int switches_ = 0;  ///< Switches likewise.
};

}  // namespace morphbus::dynarole
