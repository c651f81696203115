#include <algorithm>

#include "compiler/dynarole/checker.h"
#include "compiler/dynarole/constants.h"
#include "vm/image/fault_text.h"

namespace morphbus::dynarole {

namespace {

constexpr int kMaxConstantDepth = 16;

}  // namespace

// Constants rest on nothing but each other, so one pass, aloud, is enough.
void Checker::CheckConstants() {
  phase_ = Phase::kFinal;
  for (size_t i = 0; i < model_.constants.size(); ++i) ResolveConstant(static_cast<int>(i));
}

void Checker::ResolveConstant(int index) {
  ConstantModel& constant = model_.constants[index];
  if (constant.type != Type::kUnknown) return;
  // A constant may stand before those that it rests on, but the chain must be short, as each of
  // them costs the stack as much as a deep expression.
  if (constant_depth_ == kMaxConstantDepth) {
    Error(constant.span, "constants rest on each other too deeply").hint =
        "declare each constant behind those that it rests on";
    constant.type = Type::kError;
    return;
  }
  ++constant_depth_;
  // It sees the names of the role in which it stands, whoever needs it.
  const int role = role_;
  role_ = constant.role;
  routine_ = nullptr;
  constant.busy = true;
  Type type = Infer(constant.expr);
  constant.busy = false;
  --constant_depth_;
  role_ = role;
  const FoldResult folded = Fold(*constant.expr);
  if (folded.value && type != Type::kError) {
    constant.cell = folded.value->cell;
  } else if (type != Type::kError && folded.fault != vm::FaultCode::kNone) {
    Error(constant.expr->span,
          std::string("value of the constant cannot be computed: ") + vm::FaultName(folded.fault));
    type = Type::kError;
  } else if (type != Type::kError) {
    Error(constant.expr->span, "value of a constant must be known at compile time").hint =
        "numbers, true, false, directions, axes, roles and other constants are";
    type = Type::kError;
  }
  constant.type = type;
}

Type Checker::InferConstant(Expr* expr, int index) {
  ConstantModel& constant = model_.constants[index];
  constant.used = true;
  if (constant.busy) {
    Error(expr->span, "constant '" + constant.name + "' rests on itself")
        .Note(constant.span, "declared here");
    return Type::kError;
  }
  ResolveConstant(index);
  expr->meaning = Meaning::kConstant;
  expr->cell = constant.cell;
  return constant.type;
}

}  // namespace morphbus::dynarole
