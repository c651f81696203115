#pragma once
// Values that are known at compile time.

#include <functional>
#include <optional>

#include "compiler/dynarole/ast.h"

namespace morphbus::dynarole {

struct Constant {
  Type type = Type::kUnknown;
  vm::Cell cell;
};

struct FoldResult {
  std::optional<Constant> value;
  vm::FaultCode fault = vm::FaultCode::kNone;  ///< What its evaluation always ends with, if so.
};

/// Value of the field in a slot, where fields count as known.
using FieldValues = std::function<std::optional<Constant>(int slot)>;

/// Evaluates a checked expression with the VM's arithmetic, if all it needs is known.
FoldResult Fold(const Expr& expr, const FieldValues* fields = nullptr);

}  // namespace morphbus::dynarole
