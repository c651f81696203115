#include "compiler/dynarole/constant_checker.h"

#include <string>

#include "compiler/dynarole/constants.h"
#include "vm/image/fault_text.h"

namespace morphbus::dynarole {

namespace {

// Far more than a reader follows, and little enough for the stack.
constexpr int kMaxConstantDepth = 16;

}  // namespace

void ConstantChecker::CheckAll() {
  for (size_t i = 0; i < model_.constants.size(); ++i) Resolve(static_cast<int>(i));
}

void ConstantChecker::Resolve(int index) {
  ConstantModel& constant = model_.constants[index];
  // Each is computed once, at the first that needs it.
  if (constant.type != Type::kUnknown) return;
  // A constant may stand before those that it rests on, but the chain must be short, as each of
  // them costs the stack as much as a deep expression.
  if (depth_ == kMaxConstantDepth) {
    pass_.Error(constant.span, "constants rest on each other too deeply").hint =
        "declare each constant behind those that it rests on";
    constant.type = Type::kError;
    return;
  }
  ++depth_;
  // It sees the names of the role in which it stands, whoever needs it.
  const int role = scope_.role_index();
  scope_.EnterValue(constant.role);
  constant.busy = true;
  Type type = infer_(constant.expr);
  constant.busy = false;
  --depth_;
  scope_.EnterValue(role);
  // A constant without a value has the type of an error, so that its users are not reported, too.
  const FoldResult folded = Fold(*constant.expr);
  if (folded.value && type != Type::kError) {
    constant.cell = folded.value->cell;
  } else if (type != Type::kError && folded.fault != vm::FaultCode::kNone) {
    pass_.Error(constant.expr->span, std::string("value of the constant cannot be computed: ") +
                                         vm::FaultName(folded.fault));
    type = Type::kError;
  } else if (type != Type::kError) {
    pass_.Error(constant.expr->span, "value of a constant must be known at compile time").hint =
        "numbers, true, false, directions, axes, roles and other constants are";
    type = Type::kError;
  }
  constant.type = type;
}

Type ConstantChecker::Infer(Expr* expr, int index) {
  ConstantModel& constant = model_.constants[index];
  constant.used = true;
  // It has been come upon again while its own value is computed.
  if (constant.busy) {
    pass_.Error(expr->span, "constant '" + constant.name + "' rests on itself")
        .Note(constant.span, "declared here");
    return Type::kError;
  }
  Resolve(index);
  expr->meaning = Meaning::kConstant;
  expr->cell = constant.cell;
  return constant.type;
}

}  // namespace morphbus::dynarole
