#pragma once
// Translates the expressions of one routine.

#include "compiler/dynarole/function_builder.h"

namespace morphbus::dynarole {

/// A function's code with its expressions. Every function Emit... leaves on the stack of types what
/// its code will leave on the stack of the virtual machine.
class ExpressionGenerator : public FunctionBuilder {
 public:
  /// Both must outlive the generator; constants go into the program.
  ExpressionGenerator(const source::SourceSet& sources, ProgramCode* program)
      : FunctionBuilder(sources), program_(*program) {}

  /// Emits an expression with the conversion that is wanted of it.
  void EmitExpr(const Expr& expr);
  /// Emits `+` and its kin on two operands of one type.
  void EmitArithmetic(Operator op, bool is_float);
  /// Emits the element of an array whose number lies on the stack: kLocalElement or kFieldElement,
  /// the slot of the first one and how many there are.
  void EmitElement(Meaning meaning, int first, int length, vm::ValueType type);
  /// Emits first < second (strict) or first <= second for the operands of a comparison; the other
  /// two orders are their negations.
  void EmitOrder(const Expr& expr, bool strict);
  /// Emits the set of those neighbours, in the local `rest`, that have told the fields of a role;
  /// of all for role -1.
  void EmitLeft(int rest, int role);
  /// Emits the first of them as a set of its own, and takes it out of the local.
  void EmitFirstOf(int rest, int role);
  /// Jumps if the set on the stack has no members.
  void EmitJumpIfEmpty(Target* target);
  /// Jumps if a condition does not hold, or if it does, without making a bool of it where that is
  /// possible.
  void EmitJumpUnless(const Expr& condition, Target* target);
  void EmitJumpIf(const Expr& condition, Target* target);

 private:
  void EmitConstant(Type type, vm::Cell cell);
  void Convert(const Expr& expr);
  void EmitUnconverted(const Expr& expr);
  void EmitLoad(const Expr& expr);
  void EmitBinary(const Expr& expr);
  void EmitLogic(const Expr& expr);
  void EmitChoice(const Expr& expr);
  /// Emits the negation of a comparison that has no instruction; false, and nothing, for any other
  /// condition.
  bool EmitOpposite(const Expr& condition);
  void EmitCall(const Expr& call);
  void EmitArguments(const Expr& call);
  /// Asks the neighbours of a set one after the other, for one value of all.
  void EmitOverNeighbours(const Expr& call);
  void EmitClamp(const Expr& call);
  void EmitPrint(const Expr& call);
  void EmitBuiltin(const Expr& expr, const Expr* base, const Expr* call);

  ProgramCode& program_;
};

}  // namespace morphbus::dynarole
