#pragma once
// Conditions of a connection: expressions to solver::Condition. Internal to the connection checker.

#include "compiler/m3l/checker.h"

namespace morphbus::m3l::internal {

/// A member of a connection and what its names stand for.
struct ConditionScope {
  struct Member {
    Name name;
    const CheckedModule* module = nullptr;
    Name binder;  ///< p_a of `a.point p_a`; empty if there is none yet.
  };
  Member members[2];
  source::Diagnostics& diagnostics;
};

/// Finds the binders of `expr`; reports repeated and unknown ones, and members without one.
void CollectBinders(const Expr& expr, const source::Span& name, ConditionScope& scope);

/// The condition tree; nothing if there is an error in it.
std::optional<solver::Condition> CheckCondition(const Expr& expr, const ConditionScope& scope);

}  // namespace morphbus::m3l::internal
