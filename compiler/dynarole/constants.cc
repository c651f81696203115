#include "compiler/dynarole/constants.h"

#include <cmath>

#include "vm/image/directions.h"
#include "vm/run/mathematics.h"

namespace morphbus::dynarole {

namespace {

using vm::Cell;
using vm::FaultCode;

// A result with a value, and one that always faults.
FoldResult Value(Type type, Cell cell) { return {Constant{type, cell}, FaultCode::kNone}; }
FoldResult Faulty(FaultCode fault) { return {std::nullopt, fault}; }

// Integers of 32 bits, with the faults of the virtual machine (vm/run/interpreter.cc).
FoldResult FoldInt(Operator op, int32_t a, int32_t b) {
  int32_t result = 0;
  bool overflow = false;
  switch (op) {
    case Operator::kAdd:
      overflow = __builtin_add_overflow(a, b, &result);
      break;
    case Operator::kSub:
      overflow = __builtin_sub_overflow(a, b, &result);
      break;
    case Operator::kMul:
      overflow = __builtin_mul_overflow(a, b, &result);
      break;
    case Operator::kDiv:
      if (b == 0) return Faulty(FaultCode::kDivisionByZero);
      // Only the smallest int divided by -1 overflows; in C++ that is undefined, so it is never
      // computed.
      overflow = b == -1 && __builtin_sub_overflow(0, a, &result);
      if (b != -1) result = a / b;
      break;
    case Operator::kMod:
      if (b == 0) return Faulty(FaultCode::kDivisionByZero);
      result = b == -1 ? 0 : a % b;
      break;
    default:
      return {};
  }
  return overflow ? Faulty(FaultCode::kIntegerOverflow) : Value(Type::kInt, Cell::Int(result));
}

// Floats of single precision, rounded as the virtual machine rounds them.
FoldResult FoldFloat(Operator op, float a, float b) {
  // What is divided by zero has no value.
  if (b == 0 && (op == Operator::kDiv || op == Operator::kMod)) {
    return Faulty(FaultCode::kDivisionByZero);
  }
  const float result = op == Operator::kAdd   ? a + b
                       : op == Operator::kSub ? a - b
                       : op == Operator::kMul ? a * b
                       : op == Operator::kDiv ? a / b
                                              : std::fmod(a, b);
  return std::isfinite(result) ? Value(Type::kFloat, Cell::Float(result))
                               : Faulty(FaultCode::kNotFinite);
}

// Comparisons never fault; an operator of another kind has no value here.
template <typename T>
FoldResult FoldComparison(Operator op, T a, T b) {
  const auto truth = [](bool holds) { return Value(Type::kBool, Cell::Bool(holds)); };
  switch (op) {
    case Operator::kEqual:
      return truth(a == b);
    case Operator::kNotEqual:
      return truth(a != b);
    case Operator::kLess:
      return truth(a < b);
    case Operator::kLessEqual:
      return truth(a <= b);
    case Operator::kGreater:
      return truth(a > b);
    case Operator::kGreaterEqual:
      return truth(a >= b);
    default:
      return {};
  }
}

// `-x` and `!x` of a value that is known.
FoldResult FoldUnary(const Expr& expr, const FieldValues* fields) {
  const Expr& operand = *expr.operands[0];
  // The smallest int has no positive counterpart, so its sign belongs to it.
  if (expr.op == Operator::kNegate && operand.kind == ExprKind::kInt &&
      operand.wanted != Type::kFloat) {
    return Value(Type::kInt, Cell::Int(static_cast<int32_t>(-operand.integer)));
  }
  // Otherwise the value of the operand is negated, which may overflow as any difference may.
  const FoldResult inner = Fold(operand, fields);
  if (!inner.value) return inner;
  const Constant& value = *inner.value;
  if (expr.op == Operator::kNot && value.type == Type::kBool) {
    return Value(Type::kBool, Cell::Bool(!value.cell.AsBool()));
  }
  if (expr.op != Operator::kNegate) return {};
  if (value.type == Type::kInt) return FoldInt(Operator::kSub, 0, value.cell.AsInt());
  if (value.type == Type::kFloat) return Value(Type::kFloat, Cell::Float(-value.cell.AsFloat()));
  return {};
}

/// `x + y`, `x == y` and `x && y` of values that are known.
FoldResult FoldBinary(const Expr& expr, const FieldValues* fields) {
  // Operands are evaluated from the left, so that the first fault is the one of the program.
  const FoldResult left = Fold(*expr.operands[0], fields);
  if (!left.value) return left;
  const Constant& a = *left.value;
  if (expr.op == Operator::kAnd || expr.op == Operator::kOr) {
    // The second operand is not even looked at if the first decides.
    if (a.type == Type::kBool && a.cell.AsBool() == (expr.op == Operator::kOr)) return left;
    return Fold(*expr.operands[1], fields);
  }
  const FoldResult right = Fold(*expr.operands[1], fields);
  if (!right.value) return right;
  const Constant& b = *right.value;
  // A sum of directions is one, if they are square to each other; $ANY is none.
  if (a.type == Type::kDirection && b.type == Type::kDirection && expr.op == Operator::kAdd) {
    const vm::Direction sum =
        vm::SumOf(static_cast<vm::Direction>(a.cell.bits), static_cast<vm::Direction>(b.cell.bits));
    if (sum == vm::Direction::kAny) return Faulty(FaultCode::kNotPerpendicular);
    return Value(Type::kDirection, Cell::Int(static_cast<int>(sum)));
  }
  // A pair of types that the checker has refused.
  if (a.type != b.type) return {};
  // Arithmetic stands before the comparisons in the enumeration.
  if (expr.op < Operator::kEqual) {
    if (a.type == Type::kInt) return FoldInt(expr.op, a.cell.AsInt(), b.cell.AsInt());
    if (a.type == Type::kFloat) return FoldFloat(expr.op, a.cell.AsFloat(), b.cell.AsFloat());
    return {};
  }
  // Bools, directions, axes and roles are compared by their numbers.
  if (a.type == Type::kFloat) return FoldComparison(expr.op, a.cell.AsFloat(), b.cell.AsFloat());
  return FoldComparison(expr.op, a.cell.AsInt(), b.cell.AsInt());
}

FoldResult WholeNumber(float value) {
  int32_t number = 0;
  return vm::ToInt(value, &number) ? Value(Type::kInt, Cell::Int(number))
                                   : Faulty(FaultCode::kIntegerOverflow);
}

// `int(x)` and `float(x)` of a number that is known.
FoldResult FoldConversion(const Expr& expr, const FieldValues* fields) {
  const FoldResult number = Fold(*expr.operands[1], fields);
  if (!number.value || number.value->type == expr.type) return number;
  if (expr.type == Type::kInt) return WholeNumber(number.value->cell.AsFloat());
  return Value(Type::kFloat, Cell::Float(static_cast<float>(number.value->cell.AsInt())));
}

// A function of the language of values that are known: mathematics as the virtual machine does it.
FoldResult FoldCall(const Expr& expr, const FieldValues* fields) {
  if (expr.meaning == Meaning::kConvert) return FoldConversion(expr, fields);
  // The size of an array.
  if (expr.meaning == Meaning::kConstant) return Value(expr.type, expr.cell);
  const bool axis = expr.opcode == vm::Opcode::kAxisOf;
  if (expr.meaning != Meaning::kBuiltin || (!vm::IsMathematics(expr.opcode) && !axis)) return {};
  // No such function takes more than three numbers.
  Cell arguments[3];
  for (size_t i = 1; i < expr.operands.size() && i <= 3; ++i) {
    const FoldResult argument = Fold(*expr.operands[i], fields);
    if (!argument.value) return argument;
    arguments[i - 1] = argument.value->cell;
  }
  if (axis) {
    const vm::Direction direction = static_cast<vm::Direction>(arguments[0].bits);
    return Value(Type::kAxis, Cell::Int(static_cast<int>(vm::AxisOf(direction))));
  }
  if (expr.operands.size() == 4) {
    // A number that is clamped: the lesser of the last and the greater of the others.
    arguments[0] = Cell::Float(
        vm::Mathematics(vm::Opcode::kMax, arguments[0].AsFloat(), arguments[1].AsFloat()));
    arguments[1] = arguments[2];
  }
  const float result = vm::Mathematics(expr.opcode, arguments[0].AsFloat(), arguments[1].AsFloat());
  // What becomes a float again need not fit an int in between.
  if (IsWholeNumber(expr) && expr.wanted != Type::kFloat) return WholeNumber(result);
  return std::isfinite(result) ? Value(Type::kFloat, Cell::Float(result))
                               : Faulty(FaultCode::kNotFinite);
}

// Everything that depends on the robot, on variables or on calls has no value yet.
FoldResult FoldUnconverted(const Expr& expr, const FieldValues* fields) {
  switch (expr.kind) {
    case ExprKind::kInt:
      // 2147483648 is an int only behind a sign, which FoldUnary sees to.
      if (expr.integer > 2147483647) return {};
      return Value(Type::kInt, Cell::Int(static_cast<int32_t>(expr.integer)));
    case ExprKind::kFloat:
      return Value(Type::kFloat, Cell::Float(static_cast<float>(expr.number)));
    case ExprKind::kBool:
      return Value(Type::kBool, Cell::Bool(expr.integer != 0));
    case ExprKind::kDollar:
      if (expr.meaning != Meaning::kConstant) return {};
      return Value(expr.type, expr.cell);
    case ExprKind::kName:
      if (expr.meaning == Meaning::kConstant) return Value(expr.type, expr.cell);
      if (expr.meaning == Meaning::kField && fields != nullptr) {
        // A field is known where the caller says so.
        const std::optional<Constant> value = (*fields)(expr.index);
        if (value) return {value, FaultCode::kNone};
      }
      return {};
    case ExprKind::kMember:
      // A value of an enumeration, by its full name.
      if (expr.meaning == Meaning::kConstant) return Value(expr.type, expr.cell);
      return {};
    case ExprKind::kUnary:
      return FoldUnary(expr, fields);
    case ExprKind::kBinary:
      return FoldBinary(expr, fields);
    case ExprKind::kChoice: {
      // Only the value that is chosen has to be known.
      const FoldResult condition = Fold(*expr.operands[0], fields);
      if (!condition.value) return condition;
      return Fold(*expr.operands[condition.value->cell.AsBool() ? 1 : 2], fields);
    }
    case ExprKind::kCall:
      return FoldCall(expr, fields);
    default:
      return {};
  }
}

}  // namespace

int ParameterOf(const Expr& expr) {
  const bool as_it_is = expr.wanted == Type::kUnknown || expr.wanted == expr.type;
  return expr.meaning == Meaning::kParameter && expr.kind == ExprKind::kName && as_it_is
             ? expr.index
             : -1;
}

FoldResult Fold(const Expr& expr, const FieldValues* fields) {
  FoldResult result = FoldUnconverted(expr, fields);
  if (!result.value) return result;
  // What the checker wants of the expression happens to its value too.
  Constant& value = *result.value;
  if (expr.wanted == Type::kFloat && value.type == Type::kInt) {
    value = {Type::kFloat, Cell::Float(static_cast<float>(value.cell.AsInt()))};
  } else if (value.type == Type::kAny &&
             (expr.wanted == Type::kDirection || expr.wanted == Type::kAxis)) {
    value.type = expr.wanted;
  }
  return result;
}

}  // namespace morphbus::dynarole
