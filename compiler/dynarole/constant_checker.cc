#include "compiler/dynarole/constant_checker.h"

#include <string>

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
  if (constant.is_parameter()) {
    ResolveParameter(&constant);
  } else {
    // A constant without a value has the type of an error, so that its users are not reported, too.
    const std::optional<Constant> value = Evaluate(constant, constant.expr);
    constant.type = value ? value->type : Type::kError;
    if (value) constant.cell = value->cell;
  }
  constant.busy = false;
  --depth_;
  scope_.EnterValue(role);
}

std::optional<Constant> ConstantChecker::Evaluate(const ConstantModel& constant, Expr* expr) {
  const Type type = infer_(expr);
  if (type == Type::kError) return std::nullopt;
  const FoldResult folded = Fold(*expr);
  if (folded.value) return Constant{type, folded.value->cell};
  if (folded.fault != vm::FaultCode::kNone) {
    pass_.Error(expr->span, "value of the " + constant.Kind() +
                                " cannot be computed: " + vm::FaultName(folded.fault));
  } else {
    pass_.Error(expr->span, "value of a " + constant.Kind() + " must be known at compile time")
        .hint =
        "numbers, true, false, directions, axes, roles and constants are; parameters are not, "
        "since a run may choose them";
  }
  return std::nullopt;
}

void ConstantChecker::ResolveParameter(ConstantModel* parameter) {
  parameter->type = Type::kError;
  // The value decides the type. The ends of the range may be ints where it is a float.
  std::optional<Constant> values[3];
  Expr* const exprs[] = {parameter->expr, parameter->least, parameter->most};
  for (int i = 0; i < 3; ++i) {
    values[i] = Evaluate(*parameter, exprs[i]);
    if (!values[i]) return;
    Constant& value = *values[i];
    if (i > 0 && value.type == Type::kInt && values[0]->type == Type::kFloat) {
      value = {Type::kFloat, vm::Cell::Float(static_cast<float>(value.cell.AsInt()))};
    }
    if (value.type == values[0]->type && IsNumber(value.type)) continue;
    source::Diagnostic& error =
        pass_.Error(exprs[i]->span,
                    i == 0 ? "a parameter is a number, but this is " + NameOf(value.type)
                           : "parameter '" + parameter->name + "' is " + NameOf(values[0]->type) +
                                 ", but this is " + NameOf(value.type));
    if (value.type == Type::kFloat) error.hint = "for a float give its value a decimal point";
    return;
  }
  const auto above = [&](const Constant& a, const Constant& b) {
    return a.type == Type::kInt ? a.cell.AsInt() > b.cell.AsInt()
                                : a.cell.AsFloat() > b.cell.AsFloat();
  };
  if (above(*values[1], *values[2])) {
    pass_.Error(parameter->least->span, "the range of a parameter begins with its least value");
    return;
  }
  if (above(*values[1], *values[0]) || above(*values[0], *values[2])) {
    pass_.Error(parameter->expr->span, "the value is out of the parameter's range");
    return;
  }
  parameter->type = values[0]->type;
  parameter->cell = values[0]->cell;
  parameter->least_cell = values[1]->cell;
  parameter->most_cell = values[2]->cell;
}

Type ConstantChecker::Infer(Expr* expr, int index) {
  ConstantModel& constant = model_.constants[index];
  constant.used = true;
  // It has been come upon again while its own value is computed.
  if (constant.busy) {
    pass_.Error(expr->span, constant.Kind() + " '" + constant.name + "' rests on itself")
        .Note(constant.span, "declared here");
    return Type::kError;
  }
  Resolve(index);
  // What a run may choose is not known now.
  expr->meaning = constant.is_parameter() ? Meaning::kParameter : Meaning::kConstant;
  expr->index = index;
  expr->cell = constant.cell;
  return constant.type;
}

}  // namespace morphbus::dynarole
