#include "compiler/dynarole/codegen.h"

#include <algorithm>
#include <string>

#include "compiler/base/check.h"
#include "compiler/dynarole/function_builder.h"
#include "vm/image/image.h"

namespace morphbus::dynarole {

namespace {

using source::Span;
using vm::Opcode;
using vm::ValueType;

// Equal constants of one type share an entry of the image.
using ConstantPool = std::map<std::pair<ValueType, uint32_t>, int>;

// Translates one routine by a walk over its tree. Every function Emit... leaves on the stack of
// types what its code will leave on the stack of the virtual machine.
class FunctionGenerator : private FunctionBuilder {
 public:
  FunctionGenerator(const source::SourceSet& sources, const Routine& routine, ConstantPool* pool,
                    ProgramCode* program)
      : FunctionBuilder(sources), routine_(routine), pool_(*pool), program_(*program) {}

  FunctionCode Generate(source::Diagnostics* diagnostics) {
    // Requirements and labels are one expression, whose value they return.
    const Member& member = *routine_.member;
    if (member.expr != nullptr) {
      MarkLine(member.expr->span);
      EmitExpr(*member.expr);
      Emit(Opcode::kReturnValue);
      Drop(1);
    } else {
      // Everything else is a block, at whose start only the parameters have values.
      for (size_t i = 0; i < member.parameters.size(); ++i) Set(static_cast<int>(i));
      EmitStatement(*member.body);
      if (reachable) {
        MarkLine({member.body->span.file, member.body->span.end - 1, member.body->span.end});
        Emit(Opcode::kReturn);
      }
    }
    // Offsets in a function have 16 bits, and the image states only so many operands at a join.
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
  // The image tells the verifier which locals have values at a join; this keeps count.
  void Set(int local) { set_locals = static_cast<uint16_t>(set_locals | 1u << local); }

  // ---- Statements ----

  void EmitStatement(const Stmt& statement) {
    // The verifier accepts no code that nothing leads to.
    if (!reachable) return;
    if (statement.kind != StmtKind::kBlock) MarkLine(statement.span);
    switch (statement.kind) {
      case StmtKind::kBlock: {
        // A variable of the block has no value behind it.
        const uint16_t outer = set_locals;
        for (const StmtPtr& inner : statement.body) EmitStatement(*inner);
        set_locals = outer;
        break;
      }
      case StmtKind::kExpr: {
        // Results that nobody uses are dropped.
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
    // `x += y` reads x first.
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
    // A condition that is known decides at compile time which branch there is.
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
    // The branches meet at `end`, unless the first one never gets there.
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
    // The jump back leads to the condition, which is evaluated before every round.
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
    // Either side of `&&` may send it to the target.
    if (condition.kind == ExprKind::kBinary && condition.op == Operator::kAnd) {
      EmitJumpUnless(*condition.operands[0], target);
      EmitJumpUnless(*condition.operands[1], target);
      return;
    }
    // `!x` jumps on the opposite.
    if (condition.kind == ExprKind::kUnary && condition.op == Operator::kNot) {
      EmitExpr(*condition.operands[0]);
      Drop(1);
      Jump(Opcode::kJumpIfTrue, target);
      return;
    }
    // `a > b` is the negation of `a <= b`, for which there is an instruction.
    if (condition.kind == ExprKind::kBinary &&
        (condition.op == Operator::kGreater || condition.op == Operator::kGreaterEqual)) {
      EmitExpr(*condition.operands[0]);
      EmitExpr(*condition.operands[1]);
      EmitOrder(condition, condition.op == Operator::kGreaterEqual);
      Drop(1);
      Jump(Opcode::kJumpIfTrue, target);
      return;
    }
    // Any other condition is computed as a bool.
    EmitExpr(condition);
    Drop(1);
    Jump(Opcode::kJumpIfFalse, target);
  }

  // ---- Expressions ----

  void EmitConstant(Type type, vm::Cell cell) {
    // Small ints stand in the instruction; all else in the table of constants.
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
    // What is known needs no code but its value.
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
    // A set becomes its only member, or the number of its members; an int becomes a float.
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

  // Each kind of set has its own instruction, as modules are counted once whatever connectors they
  // are on.
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
        // A part of the module is a value; every other member is a property without arguments.
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

  // Instructions that only push a value, and have one operand that says which.
  void EmitLoad(const Expr& expr) {
    // The rows follow the order of Meaning.
    const int row = static_cast<int>(expr.meaning) - static_cast<int>(Meaning::kLocal);
    constexpr Opcode kLoads[] = {Opcode::kLoadLocal, Opcode::kLoadField, Opcode::kLoadLabel,
                                 Opcode::kKeyword};
    MORPHBUS_CHECK(row >= 0 && row < std::ssize(kLoads));
    Emit(kLoads[row], expr.index);
    Push(ValueTypeOf(expr.type));
  }

  void EmitArithmetic(Operator op, bool is_float) {
    // The rows follow the order of Operator.
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
    // The operands have been converted to one type, which that of the last one shows.
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
      case Operator::kLessEqual:
        EmitOrder(expr, expr.op == Operator::kLess);
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
    // The instruction keeps the first value if it decides, and drops it for the second if not.
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
        // The arguments are gone, and the result, if there is one, is there.
        if (call.type != Type::kVoid) Push(ValueTypeOf(call.type));
        return;
      }
      case Meaning::kInvoke:
        EmitArguments(call);
        Emit(Opcode::kInvoke, call.role);
        // The role says which modules run the command, and the slot which command it is.
        EmitByte(call.index);
        Drop(call.operands.size() - 1);
        return;
      default:
        EmitBuiltin(call, *call.operands[0]->operands[0], &call);
    }
  }

  // In the order of the parameters, which is that of the first locals of the callee.
  void EmitArguments(const Expr& call) {
    for (size_t i = 1; i < call.operands.size(); ++i) EmitExpr(*call.operands[i]);
  }

  // `base` is what stands before the dot: self, which is nothing, or a joint or connector.
  void EmitBuiltin(const Expr& expr, const Expr& base, const Expr* call) {
    // Operands go onto the stack in the order of the signature in vm/image/opcodes.def: first the
    // joint or connector before the dot.
    if (base.kind != ExprKind::kSelf) EmitExpr(base);
    if (call != nullptr) EmitArguments(*call);
    // `self.connected` without arguments means every direction, $ANY.
    if (expr.opcode == Opcode::kConnected && (call == nullptr || call->operands.size() == 1)) {
      EmitConstant(Type::kDirection, vm::Cell{});
    }
    // A fault of the call is one of its own line, also where the call began lines before.
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

  int Count(int index) {
    // Each routine is counted once; the checker has seen to it that calls end.
    if (cells_[index] >= 0) return cells_[index];
    const Routine& routine = model_.routines[index];
    // Whichever subrole is played, its function in that slot must fit.
    int callee_cells = 0;
    for (const int callee : model_.CalleesOf(routine)) {
      callee_cells = std::max(callee_cells, Count(callee));
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
  // One table of constants serves the whole program.
  ConstantPool pool;
  for (const Routine& routine : model.routines) {
    FunctionGenerator generator(sources, routine, &pool, &code);
    code.functions.push_back(generator.Generate(diagnostics));
  }
  // A task has a fixed number of cells for all the calls that nest in it.
  CellCounter counter(model, code);
  for (size_t i = 0; i < model.routines.size(); ++i) {
    const int cells = counter.Count(static_cast<int>(i));
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
