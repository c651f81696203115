#pragma once
// What the surroundings of an expression want of its value.

#include <string>

#include "compiler/dynarole/scope.h"

namespace morphbus::dynarole {

/// Has values converted to what is wanted of them: an int where a float is wanted, `$ANY` where a
/// direction or an axis is, a set where its only member is. All expressions have been given their
/// types before.
class Conversions {
 public:
  /// Both must outlive it.
  Conversions(Scope* scope, CheckPass* pass) : scope_(*scope), pass_(*pass) {}

  /// Records that the expression is to be converted to a type, or reports why it cannot be; `what`
  /// begins the message: "argument 2 of 'self.joints'".
  void Want(Expr* expr, Type wanted, const std::string& what);
  /// Tells a parameter of unknown type, alone or in a sum, that its surroundings want this one.
  void Hint(Expr* expr, Type type);

 private:
  Scope& scope_;
  CheckPass& pass_;
};

}  // namespace morphbus::dynarole
