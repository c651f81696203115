#pragma once
// Calls of what a program declares itself: functions of the role, what a member replaces, commands
// of roles and of neighbours, and fields that neighbours share.

#include <string>

#include "compiler/dynarole/conversions.h"

namespace morphbus::dynarole {

/// Finds the types and meanings of such calls, whose arguments have their types. All its functions
/// return the type; `call` is the call, whose first operand is what is called.
class CallChecker {
 public:
  /// All arguments must outlive it.
  CallChecker(ProgramModel* model, Scope* scope, Conversions* conversions, CheckPass* pass)
      : model_(*model), scope_(*scope), conversions_(*conversions), pass_(*pass) {}

  /// A call of a function of the role, which has this method slot.
  Type InferMethod(Expr* call, const std::string& name, const source::Span& span, int slot);
  /// A command of another role, or of the own one, by its name: Role.command(...); kInvokeNear for
  /// one of neighbours.
  Type InferInvoke(Expr* member, Expr* call, int role, Meaning meaning = Meaning::kInvoke);
  /// The role that all modules of a set play, where the expression says it by name: -1 if not.
  [[nodiscard]] int RoleOf(const Expr& set) const;
  /// What stands behind the dot of a set of neighbours: a shared field of their role, for which
  /// `call` is null, or a command.
  Type InferNeighbours(Expr* member, Expr* call);
  /// Whether a call of a name without a dot is one of a function over neighbours: sum, count, any,
  /// all, and min and max of a shared field alone.
  [[nodiscard]] static bool IsOverNeighbours(const Expr& call);
  /// Such a call: sum(SET.NAME), count(SET).
  Type InferOverNeighbours(Expr* call);
  /// `super.NAME(args)`: the routine that this one replaces. `call` is null without parentheses.
  Type InferSuper(Expr* member, Expr* call);
  /// Reports a command of the own role that is called as if it were a function. Commands run on all
  /// modules that play a role, so calling one would not say on which.
  Type CommandAsFunction(const std::string& name, const source::Span& span);

 private:
  /// Reports a name that is no command of the role.
  Type UnknownCommand(const Expr& member, const RoleModel& target);
  /// `NEIGHBOURS.NAME`, a field of their role.
  Type InferNeighbourField(Expr* member, int role);
  /// The arguments of a call must fit the signature; they may also settle types of parameters.
  void CheckArguments(Expr* call, int signature, const std::string& what);

  ProgramModel& model_;
  Scope& scope_;
  Conversions& conversions_;
  CheckPass& pass_;
};

}  // namespace morphbus::dynarole
