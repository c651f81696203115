#include "compiler/dynarole/expression_generator.h"

#include "compiler/base/check.h"
#include "compiler/dynarole/builtins.h"
#include "compiler/dynarole/print_call.h"

namespace morphbus::dynarole {

using vm::Opcode;
using vm::ValueType;

namespace {

// Each kind of set has its own instruction, as modules are counted once whatever connectors they
// are on.
Opcode CountOf(Type set) {
  return set == Type::kSet        ? Opcode::kCountModules
         : set == Type::kJointSet ? Opcode::kCountJoints
                                  : Opcode::kCountLinks;
}

}  // namespace

void ExpressionGenerator::EmitPrint(const Expr& call) {
  // Values lie in the order of their places.
  size_t values = 0;
  for (size_t i = 1; i < call.operands.size(); ++i) {
    if (call.operands[i]->kind == ExprKind::kText) continue;
    EmitExpr(*call.operands[i]);
    ++values;
  }
  // The value of a text is its number until the image has its characters; equal ones are one.
  const int text = program_.texts.NumberOf(PrintTextOf(call));
  const int constant = program_.constants.NumberOf({ValueType::kText, static_cast<uint32_t>(text)});
  MarkLine(call.span);
  Emit(Opcode::kPrint, {constant & 0xffff}, {.values = values});
}

void ExpressionGenerator::EmitConstant(Type type, vm::Cell cell) {
  // Small ints stand in the instruction; all else in the table of constants.
  const ValueType value_type = ValueTypeOf(type);
  if (value_type == ValueType::kInt && cell.AsInt() >= -128 && cell.AsInt() <= 127) {
    Emit(Opcode::kPushInt8, {cell.AsInt()});
  } else {
    const int constant = program_.constants.NumberOf({value_type, cell.bits});
    Emit(Opcode::kPushConst, {constant & 0xffff}, {.type = value_type});
  }
}

void ExpressionGenerator::EmitExpr(const Expr& expr) {
  // What is known needs no code but its value.
  const FoldResult folded = Fold(expr);
  if (folded.value) {
    EmitConstant(folded.value->type, folded.value->cell);
    return;
  }
  EmitUnconverted(expr);
  Convert(expr);
}

void ExpressionGenerator::Convert(const Expr& expr) {
  // A whole number is computed as a float, and becomes an int unless a float is wanted.
  if (IsWholeNumber(expr)) {
    if (expr.wanted != Type::kFloat) Emit(Opcode::kFloatToInt);
    return;
  }
  if (expr.wanted == Type::kUnknown || expr.wanted == expr.type) return;
  // A set becomes its only member, or the number of its members; an int becomes a float.
  if (expr.type == Type::kJointSet && expr.wanted == Type::kJoint) {
    Emit(Opcode::kOneJoint);
  } else if (expr.type == Type::kLinkSet && expr.wanted == Type::kLink) {
    Emit(Opcode::kOneLink);
  } else if (IsSet(expr.type)) {
    Emit(CountOf(expr.type));
    if (expr.wanted == Type::kFloat) Emit(Opcode::kIntToFloat);
  } else if (expr.type == Type::kInt && expr.wanted == Type::kFloat) {
    Emit(Opcode::kIntToFloat);
  }
}

void ExpressionGenerator::EmitUnconverted(const Expr& expr) {
  switch (expr.kind) {
    case ExprKind::kName:
    case ExprKind::kDollar:
      EmitLoad(expr);
      break;
    case ExprKind::kUnary:
      EmitExpr(*expr.operands[0]);
      Emit(expr.op == Operator::kNot   ? Opcode::kNot
           : expr.type == Type::kFloat ? Opcode::kNegFloat
                                       : Opcode::kNegInt);
      break;
    case ExprKind::kBinary:
      EmitBinary(expr);
      break;
    case ExprKind::kChoice:
      EmitChoice(expr);
      break;
    case ExprKind::kMember:
      // A neighbour's field needs the set before the dot.
      if (expr.meaning == Meaning::kNeighbourField) {
        EmitExpr(*expr.operands[0]);
        MarkLine(expr.span);
        Emit(Opcode::kNeighbourField, {expr.role, expr.index}, {.type = ValueTypeOf(expr.type)});
        break;
      }
      // A part of the module is a value; every other member is a property without arguments.
      if (expr.meaning == Meaning::kKeyword) {
        EmitLoad(expr);
      } else {
        EmitBuiltin(expr, expr.operands[0].get(), nullptr);
      }
      break;
    case ExprKind::kIndex:
      if (expr.meaning == Meaning::kLocal || expr.meaning == Meaning::kField) {
        EmitLoad(expr);
        break;
      }
      EmitExpr(*expr.operands[1]);
      MarkLine(expr.span);
      EmitElement(expr.meaning, expr.index, expr.length, ValueTypeOf(expr.type));
      break;
    case ExprKind::kCall:
      EmitCall(expr);
      break;
    default:
      MORPHBUS_CHECK(false);
  }
}

// Instructions that only push a value, and have one operand that says which.
void ExpressionGenerator::EmitLoad(const Expr& expr) {
  // A parameter is a constant to the code, whatever its value.
  if (expr.meaning == Meaning::kParameter) {
    const ValueType type = ValueTypeOf(expr.type);
    const int constant = program_.constants.NumberOf({type, expr.cell.bits, expr.index});
    Emit(Opcode::kPushConst, {constant & 0xffff}, {.type = type});
    return;
  }
  const bool known = expr.meaning == Meaning::kLocal || expr.meaning == Meaning::kField ||
                     expr.meaning == Meaning::kLabel || expr.meaning == Meaning::kKeyword;
  MORPHBUS_CHECK(known);
  Emit(expr.meaning == Meaning::kLocal   ? Opcode::kLoadLocal
       : expr.meaning == Meaning::kField ? Opcode::kLoadField
       : expr.meaning == Meaning::kLabel ? Opcode::kLoadLabel
                                         : Opcode::kKeyword,
       {expr.index}, {.type = ValueTypeOf(expr.type)});
}

void ExpressionGenerator::EmitElement(Meaning meaning, int first, int length, ValueType type) {
  Emit(meaning == Meaning::kLocalElement ? Opcode::kLoadLocalElement : Opcode::kLoadFieldElement,
       {first | length << 8}, {.type = type});
}

void ExpressionGenerator::EmitArithmetic(Operator op, bool is_float) {
  // The rows follow the order of Operator.
  const int row = static_cast<int>(op) - static_cast<int>(Operator::kAdd);
  constexpr Opcode kInt[] = {Opcode::kAddInt, Opcode::kSubInt, Opcode::kMulInt, Opcode::kDivInt,
                             Opcode::kModInt};
  constexpr Opcode kFloat[] = {Opcode::kAddFloat, Opcode::kSubFloat, Opcode::kMulFloat,
                               Opcode::kDivFloat, Opcode::kModFloat};
  Emit(is_float ? kFloat[row] : kInt[row]);
}

// first < second (strict) or first <= second; the other two orders are their negations.
void ExpressionGenerator::EmitOrder(const Expr& expr, bool strict) {
  const bool is_float = stack().back() == ValueType::kFloat;
  MORPHBUS_CHECK(expr.operands.size() == 2);
  Emit(is_float ? (strict ? Opcode::kLessFloat : Opcode::kLessEqualFloat)
                : (strict ? Opcode::kLessInt : Opcode::kLessEqualInt));
}

void ExpressionGenerator::EmitBinary(const Expr& expr) {
  // These two need not evaluate their second operand.
  if (expr.op == Operator::kAnd || expr.op == Operator::kOr) {
    EmitLogic(expr);
    return;
  }
  // The operands have been converted to one type, which that of the last one shows.
  EmitExpr(*expr.operands[0]);
  EmitExpr(*expr.operands[1]);
  const bool is_float = stack().back() == ValueType::kFloat;
  switch (expr.op) {
    case Operator::kEqual:
    case Operator::kNotEqual:
      if (is_float) {
        Emit(Opcode::kEqualFloat);
        if (expr.op == Operator::kNotEqual) Emit(Opcode::kNot);
      } else {
        Emit(expr.op == Operator::kEqual ? Opcode::kEqual : Opcode::kNotEqual);
      }
      break;
    case Operator::kLess:
    case Operator::kLessEqual:
      EmitOrder(expr, expr.op == Operator::kLess);
      break;
    case Operator::kGreater:
    case Operator::kGreaterEqual:
      EmitOrder(expr, expr.op == Operator::kGreaterEqual);
      Emit(Opcode::kNot);
      break;
    default:
      if (expr.type == Type::kDirection) {
        Emit(Opcode::kAddDirection);
      } else {
        EmitArithmetic(expr.op, is_float);
      }
  }
}

void ExpressionGenerator::EmitLogic(const Expr& expr) {
  // The instruction keeps the first value if it decides, and drops it for the second if not.
  Target end;
  EmitExpr(*expr.operands[0]);
  Jump(expr.op == Operator::kAnd ? Opcode::kAnd : Opcode::kOr, &end);
  EmitExpr(*expr.operands[1]);
  Place(&end);
}

void ExpressionGenerator::EmitChoice(const Expr& expr) {
  // A condition that is known leaves one value.
  const FoldResult known = Fold(*expr.operands[0]);
  if (known.value) return EmitExpr(*expr.operands[known.value->cell.AsBool() ? 1 : 2]);
  // Either value lies on the stack where the ways meet.
  Target otherwise, end;
  EmitJumpUnless(*expr.operands[0], &otherwise);
  EmitExpr(*expr.operands[1]);
  Jump(Opcode::kJump, &end);
  Place(&otherwise);
  EmitExpr(*expr.operands[2]);
  Place(&end);
}

bool ExpressionGenerator::EmitOpposite(const Expr& condition) {
  // `a > b` is the negation of `a <= b`, for which there is an instruction; `a >= b` likewise.
  const bool greater =
      condition.op == Operator::kGreater || condition.op == Operator::kGreaterEqual;
  if (condition.kind != ExprKind::kBinary || !greater) return false;
  EmitExpr(*condition.operands[0]);
  EmitExpr(*condition.operands[1]);
  EmitOrder(condition, condition.op == Operator::kGreaterEqual);
  return true;
}

void ExpressionGenerator::EmitJumpUnless(const Expr& condition, Target* target) {
  // Either side of `&&` may send it to the target.
  if (condition.kind == ExprKind::kBinary && condition.op == Operator::kAnd) {
    EmitJumpUnless(*condition.operands[0], target);
    EmitJumpUnless(*condition.operands[1], target);
    return;
  }
  // `!x` jumps on the opposite.
  if (condition.kind == ExprKind::kUnary && condition.op == Operator::kNot) {
    EmitExpr(*condition.operands[0]);
    Jump(Opcode::kJumpIfTrue, target);
    return;
  }
  if (EmitOpposite(condition)) return Jump(Opcode::kJumpIfTrue, target);
  // Any other condition is computed as a bool.
  EmitExpr(condition);
  Jump(Opcode::kJumpIfFalse, target);
}

void ExpressionGenerator::EmitJumpIf(const Expr& condition, Target* target) {
  // Of `a && b` the first may keep from the target, and the second sends to it.
  if (condition.kind == ExprKind::kBinary && condition.op == Operator::kAnd) {
    Target otherwise;
    EmitJumpUnless(*condition.operands[0], &otherwise);
    EmitJumpIf(*condition.operands[1], target);
    Place(&otherwise);
    return;
  }
  // `!x` is the other jump.
  if (condition.kind == ExprKind::kUnary && condition.op == Operator::kNot) {
    return EmitJumpUnless(*condition.operands[0], target);
  }
  if (EmitOpposite(condition)) return Jump(Opcode::kJumpIfFalse, target);
  EmitExpr(condition);
  Jump(Opcode::kJumpIfTrue, target);
}

void ExpressionGenerator::EmitCall(const Expr& call) {
  // A routine takes its arguments, and leaves a result if it has one.
  const NamedByOperand named = {ValueTypeOf(call.type), call.operands.size() - 1};
  switch (call.meaning) {
    case Meaning::kCount:
      EmitExpr(*call.operands[1]);
      Emit(CountOf(call.operands[1]->type));
      return;
    case Meaning::kConvert:
      EmitExpr(*call.operands[1]);
      if (ValueTypeOf(call.type) == stack().back()) return;
      Emit(call.type == Type::kInt ? Opcode::kFloatToInt : Opcode::kIntToFloat);
      return;
    case Meaning::kMethod:
      EmitArguments(call);
      Emit(Opcode::kCall, {call.index}, named);
      return;
    case Meaning::kInvoke:
      EmitArguments(call);
      // The role says which modules run the command, and the slot which command it is.
      Emit(Opcode::kInvoke, {call.role, call.index}, named);
      return;
    case Meaning::kInvokeNear:
      // The set before the dot lies below the arguments.
      EmitExpr(*call.operands[0]->operands[0]);
      EmitArguments(call);
      Emit(Opcode::kInvokeNear, {call.role, call.index}, named);
      return;
    case Meaning::kOverNeighbours:
      return EmitOverNeighbours(call);
    case Meaning::kSuper:
      EmitArguments(call);
      Emit(Opcode::kCallSuper, {call.index}, named);
      return;
    default:
      if (call.opcode == Opcode::kPrint) return EmitPrint(call);
      if (call.operands[0]->name == kClamp) return EmitClamp(call);
      // A function of the language has nothing before it.
      EmitBuiltin(
          call, call.operands[0]->operands.empty() ? nullptr : call.operands[0]->operands[0].get(),
          &call);
  }
}

void ExpressionGenerator::EmitLeft(int rest, int role) {
  Emit(Opcode::kLoadLocal, {rest}, {.type = ValueType::kSet});
  if (role >= 0) Emit(Opcode::kTelling, {role});
}

void ExpressionGenerator::EmitFirstOf(int rest, int role) {
  EmitLeft(rest, role);
  Emit(Opcode::kTakeFirst);
  Emit(Opcode::kStoreLocal, {rest});
}

void ExpressionGenerator::EmitJumpIfEmpty(Target* target) {
  Emit(Opcode::kCountModules);
  Emit(Opcode::kPushInt8, {0});
  Emit(Opcode::kEqual);
  Jump(Opcode::kJumpIfTrue, target);
}

void ExpressionGenerator::EmitOverNeighbours(const Expr& call) {
  const Expr& asked = *call.operands[1];
  const std::string& name = call.operands[0]->name;
  if (asked.meaning != Meaning::kNeighbourField) {
    EmitExpr(asked);
    Emit(Opcode::kTelling, {call.role});
    Emit(Opcode::kCountModules);
    return;
  }
  EmitExpr(*asked.operands[0]);
  Emit(Opcode::kStoreLocal, {call.index});
  const auto field_of_next = [&] {
    EmitFirstOf(call.index, call.role);
    MarkLine(asked.span);
    Emit(Opcode::kNeighbourField, {asked.role, asked.index}, {.type = ValueTypeOf(asked.type)});
  };
  // What is known before the first neighbour lies on the stack: nothing of any and all, which end
  // with the first neighbour that decides; of min and max the first one's value.
  const bool any = name == "any", all = name == "all", count = name == "count";
  const bool is_float = asked.type == Type::kFloat;
  if (count || name == "sum") EmitConstant(call.type, vm::Cell{});
  if (name == "min" || name == "max") field_of_next();
  Target next, end, decided;
  Place(&next, true);
  EmitLeft(call.index, call.role);
  EmitJumpIfEmpty(&end);
  field_of_next();
  if (any || all) {
    Jump(any ? Opcode::kJumpIfFalse : Opcode::kJumpIfTrue, &next);
    EmitConstant(Type::kBool, vm::Cell::Bool(any));
    Jump(Opcode::kJump, &decided);
    Place(&end);
    EmitConstant(Type::kBool, vm::Cell::Bool(all));
    Place(&decided);
    return;
  }
  if (count) {
    Jump(Opcode::kJumpIfFalse, &next);
    EmitConstant(Type::kInt, vm::Cell::Int(1));
  }
  if (count || name == "sum") {
    EmitArithmetic(Operator::kAdd, is_float);
  } else if (name == "min") {
    Emit(is_float ? Opcode::kMin : Opcode::kMinInt);
  } else {
    Emit(is_float ? Opcode::kMax : Opcode::kMaxInt);
  }
  Jump(Opcode::kJump, &next);
  Place(&end);
}

void ExpressionGenerator::EmitClamp(const Expr& call) {
  EmitExpr(*call.operands[1]);
  EmitExpr(*call.operands[2]);
  MarkLine(call.span);
  Emit(Opcode::kMax);
  EmitExpr(*call.operands[3]);
  MarkLine(call.span);
  Emit(Opcode::kMin);
}

// In the order of the parameters, which is that of the first locals of the callee.
void ExpressionGenerator::EmitArguments(const Expr& call) {
  for (size_t i = 1; i < call.operands.size(); ++i) EmitExpr(*call.operands[i]);
}

// `base` is what stands before the dot: self or nothing, or a joint or connector.
void ExpressionGenerator::EmitBuiltin(const Expr& expr, const Expr* base, const Expr* call) {
  // Operands go onto the stack in the order of the signature in vm/image/opcodes.def: first the
  // joint or connector before the dot.
  const vm::OperandKind operand = vm::InfoOf(expr.opcode).operand;
  // A sensor stands in the instruction itself.
  const bool sensor = operand == vm::OperandKind::kSensorKeyword;
  if (base != nullptr && base->kind != ExprKind::kSelf && !sensor) EmitExpr(*base);
  if (call != nullptr) EmitArguments(*call);
  // `self.connected` without arguments means every direction, $ANY.
  if (expr.opcode == Opcode::kConnected && (call == nullptr || call->operands.size() == 1)) {
    EmitConstant(Type::kDirection, vm::Cell{});
  }
  // A fault of the call is one of its own line, also where the call began lines before.
  MarkLine(expr.span);
  // Those that have an operand take a keyword.
  if (operand == vm::OperandKind::kNone) {
    Emit(expr.opcode);
  } else {
    Emit(expr.opcode, {expr.index});
  }
}

}  // namespace morphbus::dynarole
