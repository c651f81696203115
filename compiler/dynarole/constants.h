#pragma once
// Values that are known at compile time: those of fields, and what the lints find out beforehand.

#include <functional>
#include <optional>

#include "compiler/dynarole/ast.h"
#include "vm/image/fault.h"

namespace morphbus::dynarole {

/// A value together with its type, since a cell does not say what its bits mean.
struct Constant {
  Type type = Type::kUnknown;
  vm::Cell cell;
};

/// What evaluating an expression at compile time yields. Without a value and without a fault, the
/// value depends on what happens at run time.
struct FoldResult {
  std::optional<Constant> value;
  vm::FaultCode fault = vm::FaultCode::kNone;  ///< What its evaluation always ends with, if so.
};

/// Value of the field in a slot, where fields count as known; none for a field whose value is not
/// known after all.
using FieldValues = std::function<std::optional<Constant>(int slot)>;

/// Evaluates a checked expression with the VM's arithmetic (ints of 32 bits, floats of single
/// precision), if all it needs is known, and converts the value to what is wanted of it.
/// @param fields  values of fields where those count as known: in lints of a role that cannot
///                change them. Null elsewhere, as tasks may assign to fields.
FoldResult Fold(const Expr& expr, const FieldValues* fields = nullptr);

/// The parameter that a checked expression is by itself, without conversion: its index in
/// ProgramModel::constants; -1 for any other expression.
int ParameterOf(const Expr& expr);

}  // namespace morphbus::dynarole
