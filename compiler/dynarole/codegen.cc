#include "compiler/dynarole/codegen.h"

#include <algorithm>
#include <string>

#include "compiler/dynarole/function_builder.h"
#include "compiler/source/check.h"
#include "vm/image.h"

namespace morphbus::dynarole {

namespace {

using source::Span;
using vm::Opcode;
using vm::ValueType;

using ConstantPool = std::map<std::pair<ValueType, uint32_t>, int>;

class FunctionGenerator : private FunctionBuilder {
 public:
  FunctionGenerator(const LineTable& lines, const Routine& routine, ConstantPool* pool,
                    ProgramCode* program)
      : FunctionBuilder(lines), routine_(routine), pool_(*pool), program_(*program) {}

  FunctionCode Generate(source::Diagnostics* diagnostics) {
    const Member& member = *routine_.member;
    if (member.expr != nullptr) {
      MarkLine(member.expr->span);
      EmitExpr(*member.expr);
      Emit(Opcode::kReturnValue);
      Drop(1);
    } else {
      for (size_t i = 0; i < member.parameters.size(); ++i) Set(static_cast<int>(i));
      EmitStatement(*member.body);
      if (reachable) {
        MarkLine({member.body->span.file, member.body->span.end - 1, member.body->span.end});
        Emit(Opcode::kReturn);
      }
    }
    if (size() > vm::image::kMaxFunctionBytes) {
      diagnostics->Error(member.name_span, "code is too long").hint = "split it into functions";
    }
    if (too_complex()) {
      diagnostics->Error(member.name_span, "an expression in it is too complex").hint =
          "keep parts of it in variables";
    }
    return Finish();
  }

 private:
  void Set(int local) { set_locals = static_cast<uint16_t>(set_locals | 1u << local); }

  // ---- Statements ----

  void EmitStatement(const Stmt& statement) {
    if (!reachable) return;
    if (statement.kind != StmtKind::kBlock) MarkLine(statement.span);
    switch (statement.kind) {
      case StmtKind::kBlock: {
        const uint16_t outer = set_locals;
        for (const StmtPtr& inner : statement.body) EmitStatement(*inner);
        set_locals = outer;
        break;
      }
      case StmtKind::kExpr: {
        const size_t before = stack().size();
        EmitExpr(*statement.expr);
        if (stack().size() > before) {
          Emit(Opcode::kPop);
          Drop(1);
        }
        break;
      }
      case StmtKind::kVar:
        EmitExpr(*statement.expr);
        Emit(Opcode::kStoreLocal, statement.index);
        Drop(1);
        Set(statement.index);
        break;
      case StmtKind::kAssign:
        EmitAssign(statement);
        break;
      case StmtKind::kReturn:
        if (statement.expr != nullptr) {
          EmitExpr(*statement.expr);
          Drop(1);
        }
        Emit(statement.expr != nullptr ? Opcode::kReturnValue : Opcode::kReturn);
        reachable = false;
        break;
      case StmtKind::kIf:
        EmitIf(statement);
        break;
      case StmtKind::kWhile:
        EmitWhile(statement);
        break;
      case StmtKind::kError:
        break;
    }
  }

  // A branch is a scope of its own, also without braces.
  void EmitBranch(const Stmt& statement) {
    const uint16_t outer = set_locals;
    EmitStatement(statement);
    set_locals = outer;
  }

  void EmitAssign(const Stmt& statement) {
    const bool is_local = statement.meaning == Meaning::kLocal;
    if (statement.op != Operator::kNone) {
      Emit(is_local ? Opcode::kLoadLocal : Opcode::kLoadField, statement.index);
      Push(ValueTypeOf(statement.type));
    }
    EmitExpr(*statement.expr);
    if (statement.op != Operator::kNone) {
      EmitArithmetic(statement.op, statement.type == Type::kFloat);
    }
    Emit(is_local ? Opcode::kStoreLocal : Opcode::kStoreField, statement.index);
    Drop(1);
  }

  [[nodiscard]] static std::optional<bool> KnownCondition(const Expr& condition) {
    const FoldResult folded = Fold(condition);
    if (!folded.value) return std::nullopt;
    return folded.value->cell.AsBool();
  }

  void EmitIf(const Stmt& statement) {
    const std::optional<bool> known = KnownCondition(*statement.expr);
    if (known) {
      if (*known) EmitBranch(*statement.body[0]);
      if (!*known && statement.body.size() == 2) EmitBranch(*statement.body[1]);
      return;
    }
    Target otherwise, end;
    EmitJumpUnless(*statement.expr, &otherwise);
    EmitBranch(*statement.body[0]);
    if (statement.body.size() == 2) {
      if (reachable) {
        Jump(Opcode::kJump, &end);
        reachable = false;
      }
      Place(&otherwise);
      EmitBranch(*statement.body[1]);
      Place(&end);
    } else {
      Place(&otherwise);
    }
  }

  void EmitWhile(const Stmt& statement) {
    const std::optional<bool> known = KnownCondition(*statement.expr);
    if (known && !*known) return;
    Target begin, end;
    Place(&begin, true);
    if (!known) EmitJumpUnless(*statement.expr, &end);
    EmitBranch(*statement.body[0]);
    if (reachable) {
      MarkLine(statement.span);
      Jump(Opcode::kJump, &begin);
    }
    reachable = false;
    Place(&end);
  }

  // Jumps if the condition does not hold, without making a bool of it where that is possible.
  void EmitJumpUnless(const Expr& condition, Target* target) {
    if (condition.kind == ExprKind::kBinary && condition.op == Operator::kAnd) {
      EmitJumpUnless(*condition.operands[0], target);
      EmitJumpUnless(*condition.operands[1], target);
      return;
    }
    if (condition.kind == ExprKind::kUnary && condition.op == Operator::kNot) {
      EmitExpr(*condition.operands[0]);
      Drop(1);
      Jump(Opcode::kJumpIfTrue, target);
      return;
    }
    if (condition.kind == ExprKind::kBinary &&
        (condition.op == Operator::kGreater || condition.op == Operator::kGreaterEqual)) {
      EmitExpr(*condition.operands[0]);
      EmitExpr(*condition.operands[1]);
      EmitOrder(condition, condition.op == Operator::kGreaterEqual);
      Drop(1);
      Jump(Opcode::kJumpIfTrue, target);
      return;
    }
    EmitExpr(condition);
    Drop(1);
    Jump(Opcode::kJumpIfFalse, target);
  }

  // ---- Expressions ----

  void EmitConstant(Type type, vm::Cell cell) {
    const ValueType value_type = ValueTypeOf(type);
    if (value_type == ValueType::kInt && cell.AsInt() >= -128 && cell.AsInt() <= 127) {
      Emit(Opcode::kPushInt8, cell.AsInt());
    } else {
      const auto [it, is_new] = pool_.emplace(std::make_pair(value_type, cell.bits),
                                              static_cast<int>(program_.constants.size()));
      if (is_new) program_.constants.emplace_back(value_type, cell.bits);
      Emit(Opcode::kPushConst);
      EmitU16(it->second & 0xffff);
    }
    Push(value_type);
  }

  void EmitExpr(const Expr& expr) {
    const FoldResult folded = Fold(expr);
    if (folded.value) {
      EmitConstant(folded.value->type, folded.value->cell);
      return;
    }
    EmitUnconverted(expr);
    Convert(expr);
  }

  void Convert(const Expr& expr) {
    if (expr.wanted == Type::kUnknown || expr.wanted == expr.type) return;
    if (expr.type == Type::kJointSet && expr.wanted == Type::kJoint) {
      EmitSimple(Opcode::kOneJoint);
    } else if (expr.type == Type::kLinkSet && expr.wanted == Type::kLink) {
      EmitSimple(Opcode::kOneLink);
    } else if (IsSet(expr.type)) {
      EmitSimple(CountOf(expr.type));
      if (expr.wanted == Type::kFloat) EmitSimple(Opcode::kIntToFloat);
    } else if (expr.type == Type::kInt && expr.wanted == Type::kFloat) {
      EmitSimple(Opcode::kIntToFloat);
    }
  }

  static Opcode CountOf(Type set) {
    return set == Type::kSet        ? Opcode::kCountModules
           : set == Type::kJointSet ? Opcode::kCountJoints
                                    : Opcode::kCountLinks;
  }

  void EmitUnconverted(const Expr& expr) {
    switch (expr.kind) {
      case ExprKind::kName:
      case ExprKind::kDollar:
        EmitLoad(expr);
        break;
      case ExprKind::kUnary:
        EmitExpr(*expr.operands[0]);
        EmitSimple(expr.op == Operator::kNot   ? Opcode::kNot
                   : expr.type == Type::kFloat ? Opcode::kNegFloat
                                               : Opcode::kNegInt);
        break;
      case ExprKind::kBinary:
        EmitBinary(expr);
        break;
      case ExprKind::kMember:
        if (expr.meaning == Meaning::kKeyword) {
          EmitLoad(expr);
        } else {
          EmitBuiltin(expr, *expr.operands[0], nullptr);
        }
        break;
      case ExprKind::kCall:
        EmitCall(expr);
        break;
      default:
        MORPHBUS_CHECK(false);
    }
  }

  void EmitLoad(const Expr& expr) {
    switch (expr.meaning) {
      case Meaning::kLocal:
        Emit(Opcode::kLoadLocal, expr.index);
        break;
      case Meaning::kField:
        Emit(Opcode::kLoadField, expr.index);
        break;
      case Meaning::kLabel:
        Emit(Opcode::kLoadLabel, expr.index);
        break;
      case Meaning::kKeyword:
        Emit(Opcode::kKeyword, expr.index);
        break;
      default:
        MORPHBUS_CHECK(false);
    }
    Push(ValueTypeOf(expr.type));
  }

  void EmitArithmetic(Operator op, bool is_float) {
    const int row = static_cast<int>(op) - static_cast<int>(Operator::kAdd);
    constexpr Opcode kInt[] = {Opcode::kAddInt, Opcode::kSubInt, Opcode::kMulInt, Opcode::kDivInt,
                               Opcode::kModInt};
    constexpr Opcode kFloat[] = {Opcode::kAddFloat, Opcode::kSubFloat, Opcode::kMulFloat,
                                 Opcode::kDivFloat, Opcode::kModFloat};
    EmitSimple(is_float ? kFloat[row] : kInt[row]);
  }

  // first < second (strict) or first <= second; the other two orders are their negations.
  void EmitOrder(const Expr& expr, bool strict) {
    const bool is_float = stack().back() == ValueType::kFloat;
    MORPHBUS_CHECK(expr.operands.size() == 2);
    EmitSimple(is_float ? (strict ? Opcode::kLessFloat : Opcode::kLessEqualFloat)
                        : (strict ? Opcode::kLessInt : Opcode::kLessEqualInt));
  }

  void EmitBinary(const Expr& expr) {
    if (expr.op == Operator::kAnd || expr.op == Operator::kOr) {
      EmitLogic(expr);
      return;
    }
    EmitExpr(*expr.operands[0]);
    EmitExpr(*expr.operands[1]);
    const bool is_float = stack().back() == ValueType::kFloat;
    switch (expr.op) {
      case Operator::kEqual:
      case Operator::kNotEqual:
        if (is_float) {
          EmitSimple(Opcode::kEqualFloat);
          if (expr.op == Operator::kNotEqual) EmitSimple(Opcode::kNot);
        } else {
          EmitSimple(expr.op == Operator::kEqual ? Opcode::kEqual : Opcode::kNotEqual);
        }
        break;
      case Operator::kLess:
        EmitOrder(expr, true);
        break;
      case Operator::kLessEqual:
        EmitOrder(expr, false);
        break;
      case Operator::kGreater:
      case Operator::kGreaterEqual:
        EmitOrder(expr, expr.op == Operator::kGreaterEqual);
        EmitSimple(Opcode::kNot);
        break;
      default:
        EmitArithmetic(expr.op, is_float);
    }
  }

  void EmitLogic(const Expr& expr) {
    Target end;
    EmitExpr(*expr.operands[0]);
    Jump(expr.op == Operator::kAnd ? Opcode::kAnd : Opcode::kOr, &end);
    Drop(1);
    EmitExpr(*expr.operands[1]);
    Place(&end);
  }

  void EmitCall(const Expr& call) {
    switch (call.meaning) {
      case Meaning::kCount:
        EmitExpr(*call.operands[1]);
        EmitSimple(CountOf(call.operands[1]->type));
        return;
      case Meaning::kMethod: {
        EmitArguments(call);
        Emit(Opcode::kCall, call.index);
        Drop(call.operands.size() - 1);
        if (call.type != Type::kVoid) Push(ValueTypeOf(call.type));
        return;
      }
      case Meaning::kInvoke:
        EmitArguments(call);
        Emit(Opcode::kInvoke, call.role);
        EmitByte(call.index);
        Drop(call.operands.size() - 1);
        return;
      default:
        EmitBuiltin(call, *call.operands[0]->operands[0], &call);
    }
  }

  void EmitArguments(const Expr& call) {
    for (size_t i = 1; i < call.operands.size(); ++i) EmitExpr(*call.operands[i]);
  }

  // `base` is what stands before the dot: self, which is nothing, or a joint or connector.
  void EmitBuiltin(const Expr& expr, const Expr& base, const Expr* call) {
    if (base.kind != ExprKind::kSelf) EmitExpr(base);
    if (call != nullptr) EmitArguments(*call);
    if (expr.opcode == Opcode::kConnected && (call == nullptr || call->operands.size() == 1)) {
      EmitConstant(Type::kDirection, vm::Cell{});
    }
    MarkLine(expr.span);
    Emit(expr.opcode);
    if (vm::InfoOf(expr.opcode).operand == vm::OperandKind::kKeyword) EmitByte(expr.index);
    ApplySignature(expr.opcode);
  }

  const Routine& routine_;
  ConstantPool& pool_;
  ProgramCode& program_;
};

// Cells that a function and all it may call need, as the verifier counts them.
class CellCounter {
 public:
  CellCounter(const ProgramModel& model, const ProgramCode& code)
      : model_(model), code_(code), cells_(model.routines.size(), -1) {}

  int Count(size_t index) {
    if (cells_[index] >= 0) return cells_[index];
    const Routine& routine = model_.routines[index];
    int callee_cells = 0;
    for (const CallSite& call : routine.calls) {
      for (size_t role = 0; role < model_.roles.size(); ++role) {
        if (!model_.IsA(static_cast<int>(role), routine.role)) continue;
        const int callee = model_.roles[role].methods[static_cast<size_t>(call.slot)].routine;
        callee_cells = std::max(callee_cells, Count(static_cast<size_t>(callee)));
      }
    }
    cells_[index] =
        callee_cells + code_.functions[index].max_stack + static_cast<int>(routine.locals.size());
    return cells_[index];
  }

 private:
  const ProgramModel& model_;
  const ProgramCode& code_;
  std::vector<int> cells_;
};

}  // namespace

ProgramCode Generate(const source::SourceSet& sources, const ProgramModel& model,
                     source::Diagnostics* diagnostics) {
  ProgramCode code;
  ConstantPool pool;
  const LineTable lines(sources.text(model.program->file));
  for (const Routine& routine : model.routines) {
    FunctionGenerator generator(lines, routine, &pool, &code);
    code.functions.push_back(generator.Generate(diagnostics));
  }
  CellCounter counter(model, code);
  for (size_t i = 0; i < model.routines.size(); ++i) {
    const int cells = counter.Count(i);
    if (cells <= vm::kStackCells) continue;
    diagnostics
        ->Error(model.routines[i].member->name_span,
                "needs " + std::to_string(cells) + " cells for variables and operands")
        .hint = "a task has " + std::to_string(vm::kStackCells) +
                "; use fewer variables, or let calls nest less deep";
    break;
  }
  if (code.constants.size() > 65535) {
    diagnostics->Error(model.routines[0].member->name_span, "too many constants in one program");
  }
  return code;
}

}  // namespace morphbus::dynarole
