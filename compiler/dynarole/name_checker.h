#pragma once
// Names that stand alone: of variables, fields, labels and constants, and words behind '$'.

#include "compiler/dynarole/constant_checker.h"
#include "compiler/dynarole/part_checker.h"

namespace morphbus::dynarole {

/// Finds what a name means where it stands. What is read is noted in the model, so that lints can
/// tell what nothing reads.
class NameChecker {
 public:
  /// All arguments must outlive it.
  NameChecker(const keywords::KeywordTable& keywords, ProgramModel* model, Scope* scope,
              PartChecker* parts, ConstantChecker* constants, CheckPass* pass)
      : keywords_(keywords),
        model_(*model),
        scope_(*scope),
        parts_(*parts),
        constants_(*constants),
        pass_(*pass) {}

  /// A name alone is a variable, a field, a label or a constant; anything else is unknown. Each
  /// hides those that come after it, so that what stands nearer wins.
  Type InferName(Expr* expr);
  /// The constant that is a value of an enumeration, by the names of both; -1 if none is, or
  /// where a variable, field or label has the name of the enumeration.
  [[nodiscard]] int ValueOfEnumeration(const std::string& enumeration,
                                       const std::string& value) const;
  /// Whether a name means an enumeration where it stands before a dot.
  [[nodiscard]] bool IsEnumeration(const std::string& name) const;
  /// Reports that an enumeration, before the dot, has no such value. Returns kError.
  Type UnknownValue(const Expr& member);
  /// `$NAME` is a direction, an axis, a role or a part of the module, in that order.
  Type InferDollar(Expr* expr);

 private:
  /// Reports a name that means nothing here, with what it may have meant: a name of another kind,
  /// one of a subrole, a slip. Returns kError.
  Type UnknownName(const Expr& expr);
  /// The same for a word behind '$'; the hint is the nearest word that may stand there.
  Type UnknownDollar(const Expr& expr);

  const keywords::KeywordTable& keywords_;
  ProgramModel& model_;
  Scope& scope_;
  PartChecker& parts_;
  ConstantChecker& constants_;
  CheckPass& pass_;
};

}  // namespace morphbus::dynarole
