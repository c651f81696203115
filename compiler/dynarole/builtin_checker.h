#pragma once
// Calls and properties that are built in: of self, of joints and connectors, and functions of the
// language (compiler/dynarole/builtins.h).

#include <string>
#include <vector>

#include "compiler/dynarole/builtins.h"
#include "compiler/dynarole/part_checker.h"

namespace morphbus::dynarole {

/// Finds the form of a builtin that is meant, and checks its arguments, which have their types.
class BuiltinChecker {
 public:
  /// All arguments must outlive it.
  BuiltinChecker(const keywords::KeywordTable& keywords, const ProgramModel& model, Scope* scope,
                 PartChecker* parts, Conversions* conversions, CheckPass* pass)
      : keywords_(keywords),
        model_(model),
        scope_(*scope),
        parts_(*parts),
        conversions_(*conversions),
        pass_(*pass) {}

  /// Finds the form that takes as many arguments as the call has, and gives the call its
  /// instruction. The type of a call whose name, that of `member`, stands in a table; `prefix` is
  /// what programs write before it. `call` is null where the member stands without parentheses.
  Type Infer(const std::vector<Builtin>& table, const std::string& prefix, Expr* member,
             Expr* call);

 private:
  /// What a joint can do in at least one module type: a revolute or continuous one turns, a
  /// prismatic one slides, a fixed one does neither.
  struct Motions {
    bool turns = false, slides = false;
  };

  /// Reports a joint that the call can move in no module type: at run time that would be a fault in
  /// every module.
  void CheckMotion(const Builtin& builtin, const Expr& joint);
  /// Of a joint that is named by a keyword, or any that a label may stand for in a role that
  /// inherits this code; of other expressions any joint there is.
  [[nodiscard]] Motions MotionsOf(const Expr& joint) const;
  /// Reports a number of joints that no body can have.
  void CheckCount(const Builtin& builtin, const Expr& count);

  const keywords::KeywordTable& keywords_;
  const ProgramModel& model_;
  Scope& scope_;
  PartChecker& parts_;
  Conversions& conversions_;
  CheckPass& pass_;
};

}  // namespace morphbus::dynarole
