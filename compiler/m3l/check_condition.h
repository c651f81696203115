#pragma once
// Conditions of a connection: the checker turns expressions into the trees that the solver takes
// (solver::Condition). Internal to the connection checker.

#include "compiler/m3l/checker.h"

namespace morphbus::m3l::internal {

/// What the names in a condition stand for. CheckConnection makes one for each connection; it lives
/// as long as that is checked.
struct ConditionScope {
  /// One of the two members of the connection.
  struct Member {
    /// The name that the condition uses for it: `a` of `MTRAN a`.
    Name name;
    /// The module type of the member; null while it is not known.
    const CheckedModule* module = nullptr;
    /// The name that stands for its connector, p_a of `a.point p_a`; empty if there is none yet.
    Name binder;
    /// Whether the condition names a connector of its own, as in `a.c1`.
    bool names_connector = false;
  };
  /// The members in source order, which is also the order of solver::Side.
  Member members[2];
  source::Diagnostics& diagnostics;
};

/// Finds the names that `expr` binds to connectors (`a.point p_a`) and enters them into `scope`. It
/// reports repeated and unknown ones and, at `name` (the connection's), members without one of whom
/// no connector is named (`a.c1`) either.
void CollectBinders(const Expr& expr, const source::Span& name, ConditionScope& scope);

/// The condition tree of `expr`, whose binders CollectBinders has found. Returns nothing, after
/// errors, if the expression is not sound.
std::optional<solver::Condition> CheckCondition(const Expr& expr, const ConditionScope& scope);

}  // namespace morphbus::m3l::internal
