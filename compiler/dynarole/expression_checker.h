#pragma once
// Expressions: each is given its type and meaning, after those below it in the tree.

#include "compiler/dynarole/array_checker.h"
#include "compiler/dynarole/builtin_checker.h"
#include "compiler/dynarole/call_checker.h"
#include "compiler/dynarole/constant_checker.h"
#include "compiler/dynarole/conversions.h"
#include "compiler/dynarole/name_checker.h"
#include "compiler/dynarole/operator_checker.h"
#include "compiler/dynarole/part_checker.h"

namespace morphbus::dynarole {

/// Goes through the tree of an expression, and has the checker of its kind find out what each node
/// means. None of those looks into the tree below a node; so this alone calls itself.
class ExpressionChecker {
 public:
  /// All arguments must outlive it.
  ExpressionChecker(const keywords::KeywordTable& keywords, ProgramModel* model, Scope* scope,
                    CheckPass* pass);
  ExpressionChecker(const ExpressionChecker&) = delete;
  ExpressionChecker& operator=(const ExpressionChecker&) = delete;

  /// Finds the type of an expression, and sets it in the tree with its meaning. The type is that of
  /// the value itself; conversions are asked for by Want, later.
  Type Infer(Expr* expr);
  /// The same, and that the value is to be of a type (Conversions::Want).
  void InferAs(Expr* expr, Type wanted, const std::string& what);
  /// What statements want of their values.
  [[nodiscard]] Conversions& conversions() { return conversions_; }
  /// Which role the modules of a set play.
  [[nodiscard]] const CallChecker& calls() const { return calls_; }
  /// Arrays, which statements declare and assign to.
  [[nodiscard]] ArrayChecker& arrays() { return arrays_; }
  /// The program's constants, which rest on expressions as these do on them.
  [[nodiscard]] ConstantChecker& constants() { return constants_; }

 private:
  Type InferUnconverted(Expr* expr);
  Type InferUnary(Expr* expr);
  /// `NAME[number]`
  Type InferElement(Expr* element);
  // `call` is null where a member stands without parentheses.
  /// What stands behind a dot, by what stands before it.
  Type InferMember(Expr* member, Expr* call);
  /// Finds the types of the arguments, then what is called.
  Type InferCall(Expr* call);
  /// A call of a name without a dot: of the role's own functions, or of the language's.
  Type InferFunction(Expr* call);
  /// Says what an unknown function may have meant: something of self, a command, a slip.
  Type UnknownFunction(const Expr& callee);
  /// sizeof(SET) is the number of its members.
  Type InferSizeof(Expr* call);
  /// `int(x)` and `float(x)`.
  Type InferConversion(Expr* call, Type to);
  /// `print("text", value, ...)`
  Type InferPrint(Expr* call);
  /// `self.NAME`, with or without arguments.
  Type InferSelf(Expr* member, Expr* call);
  /// Behind the dot of a joint, connector or set: self.JOINT_1.SET_POSITION(90).
  Type InferPart(Expr* member, Expr* call);

  ProgramModel& model_;
  Scope& scope_;
  CheckPass& pass_;
  Conversions conversions_;
  ArrayChecker arrays_;
  OperatorChecker operators_;
  PartChecker parts_;
  BuiltinChecker builtins_;
  CallChecker calls_;
  ConstantChecker constants_;
  NameChecker names_;
};

}  // namespace morphbus::dynarole
