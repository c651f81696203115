#include "compiler/dynarole/codegen.h"

#include <algorithm>
#include <string>

#include "compiler/base/check.h"
#include "compiler/dynarole/expression_generator.h"
#include "vm/image/image.h"

namespace morphbus::dynarole {

namespace {

using source::Span;
using vm::Opcode;

// Translates one routine by a walk over its tree.
class FunctionGenerator : private ExpressionGenerator {
 public:
  FunctionGenerator(const source::SourceSet& sources, const Routine& routine, ProgramCode* program)
      : ExpressionGenerator(sources, program), routine_(routine) {}

  FunctionCode Generate(source::Diagnostics* diagnostics) {
    // Requirements and labels are one expression, whose value they return.
    const Member& member = *routine_.member;
    if (member.expr != nullptr) {
      MarkLine(member.expr->span);
      EmitExpr(*member.expr);
      Emit(Opcode::kReturnValue);
    } else {
      // Everything else is a block, at whose start only the parameters have values.
      for (size_t i = 0; i < member.parameters.size(); ++i) SetLocal(static_cast<int>(i));
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
        if (stack().size() > before) Emit(Opcode::kPop);
        break;
      }
      case StmtKind::kVar:
        if (statement.length > 0) return EmitArray(statement);
        EmitExpr(*statement.expr);
        Emit(Opcode::kStoreLocal, {statement.index});
        break;
      case StmtKind::kAssign:
        EmitAssign(statement);
        break;
      case StmtKind::kReturn:
        if (statement.expr != nullptr) EmitExpr(*statement.expr);
        Emit(statement.expr != nullptr ? Opcode::kReturnValue : Opcode::kReturn);
        break;
      case StmtKind::kIf:
        EmitIf(statement);
        break;
      case StmtKind::kSwitch:
        EmitSwitch(statement);
        break;
      case StmtKind::kWhile:
        EmitWhile(statement);
        break;
      case StmtKind::kFor:
        EmitFor(statement);
        break;
      case StmtKind::kForEach:
        EmitForEach(statement);
        break;
      case StmtKind::kBreak:
      case StmtKind::kContinue:
        // Behind the loop, or to what it does after each round.
        Jump(Opcode::kJump,
             statement.kind == StmtKind::kBreak ? loops_.back().end : loops_.back().next);
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

  void EmitArray(const Stmt& statement) {
    const bool listed = statement.expr->kind == ExprKind::kArray;
    for (int i = 0; i < statement.length; ++i) {
      // What is one value for all is computed once.
      if (listed || i == 0) {
        EmitExpr(listed ? *statement.expr->operands[static_cast<size_t>(i)] : *statement.expr);
      } else {
        Emit(Opcode::kLoadLocal, {statement.index}, {.type = ValueTypeOf(statement.type)});
      }
      Emit(Opcode::kStoreLocal, {statement.index + i});
    }
  }

  // An assignment to an element whose number the program computes.
  void EmitAssignElement(const Stmt& statement) {
    const vm::ValueType type = ValueTypeOf(statement.type);
    EmitExpr(*statement.subscript);
    if (statement.op != Operator::kNone) {
      Emit(Opcode::kStoreLocal, {statement.rest});
      Emit(Opcode::kLoadLocal, {statement.rest}, {.type = vm::ValueType::kInt});
      Emit(Opcode::kLoadLocal, {statement.rest}, {.type = vm::ValueType::kInt});
      EmitElement(statement.meaning, statement.index, statement.length, type);
    }
    EmitExpr(*statement.expr);
    if (statement.op != Operator::kNone)
      EmitArithmetic(statement.op, type == vm::ValueType::kFloat);
    const bool is_local = statement.meaning == Meaning::kLocalElement;
    MarkLine(statement.span);
    Emit(is_local ? Opcode::kStoreLocalElement : Opcode::kStoreFieldElement,
         {statement.index | statement.length << 8});
  }

  void EmitAssign(const Stmt& statement) {
    if (statement.meaning == Meaning::kLocalElement ||
        statement.meaning == Meaning::kFieldElement) {
      return EmitAssignElement(statement);
    }
    // `x += y` reads x first.
    const bool is_local = statement.meaning == Meaning::kLocal;
    if (statement.op != Operator::kNone) {
      Emit(is_local ? Opcode::kLoadLocal : Opcode::kLoadField, {statement.index},
           {.type = ValueTypeOf(statement.type)});
    }
    EmitExpr(*statement.expr);
    // Both operands lie on the stack now, in their order.
    if (statement.op != Operator::kNone) {
      EmitArithmetic(statement.op, statement.type == Type::kFloat);
    }
    Emit(is_local ? Opcode::kStoreLocal : Opcode::kStoreField, {statement.index});
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
      if (reachable) Jump(Opcode::kJump, &end);
      Place(&otherwise);
      EmitBranch(*statement.body[1]);
      Place(&end);
    } else {
      Place(&otherwise);
    }
  }

  void EmitSwitch(const Stmt& statement) {
    const uint16_t outer = set_locals;
    if (statement.meaning != Meaning::kLocal) {
      EmitExpr(*statement.expr);
      Emit(Opcode::kStoreLocal, {statement.index});
    }
    // Values are tried in their order; what none of them is goes to `default`, or past the switch.
    std::vector<Target> blocks(statement.body.size());
    Target end;
    Target* otherwise = &end;
    for (size_t i = 0; i < blocks.size(); ++i) {
      if (statement.cases[i].is_default()) otherwise = &blocks[i];
      for (const ExprPtr& value : statement.cases[i].values) {
        MarkLine(value->span);
        Emit(Opcode::kLoadLocal, {statement.index}, {.type = ValueTypeOf(statement.type)});
        EmitExpr(*value);
        Emit(Opcode::kEqual);
        Jump(Opcode::kJumpIfTrue, &blocks[i]);
      }
    }
    // Where every value has a case the last one needs no second look.
    if (otherwise == &end && CoversAll(statement)) otherwise = &blocks.back();
    Jump(Opcode::kJump, otherwise);
    // A break leaves the switch, a continue goes on with the loop around it.
    loops_.push_back({loops_.empty() ? nullptr : loops_.back().next, &end});
    for (size_t i = 0; i < blocks.size(); ++i) {
      Place(&blocks[i]);
      EmitBranch(*statement.body[i]);
      if (reachable) Jump(Opcode::kJump, &end);
    }
    loops_.pop_back();
    Place(&end);
    set_locals = outer;
  }

  void EmitWhile(const Stmt& statement) {
    const std::optional<bool> known = KnownCondition(*statement.expr);
    // A loop that never begins leaves no code.
    if (known && !*known) return;
    EmitLoop(known ? nullptr : statement.expr.get(), *statement.body[0], nullptr, statement.span);
  }

  // The condition, if there is one, stands behind what is repeated, so that a round has one jump;
  // the first round begins with it.
  void EmitLoop(const Expr* condition, const Stmt& body, const Stmt* step, const Span& span) {
    Target begin, next, test, end;
    if (condition != nullptr) Jump(Opcode::kJump, &test);
    Place(&begin, true);
    loops_.push_back({&next, &end});
    EmitBranch(body);
    loops_.pop_back();
    // What is done after each round, and the way back; both only if some round ends.
    Place(&next);
    if (step != nullptr) EmitStatement(*step);
    if (condition != nullptr) {
      Place(&test);
      MarkLine(condition->span);
      EmitJumpIf(*condition, &begin);
    } else if (reachable) {
      MarkLine(span);
      Jump(Opcode::kJump, &begin);
    }
    Place(&end);
  }

  void EmitFor(const Stmt& statement) {
    // The variable of the head has no value behind the loop.
    const uint16_t outer = set_locals;
    EmitStatement(*statement.body[0]);
    const std::optional<bool> known =
        statement.expr != nullptr ? KnownCondition(*statement.expr) : std::optional<bool>(true);
    if (!known || *known) {
      EmitLoop(known ? nullptr : statement.expr.get(), *statement.body[2], statement.body[1].get(),
               statement.span);
    }
    set_locals = outer;
  }

  void EmitForEach(const Stmt& statement) {
    const uint16_t outer = set_locals;
    EmitExpr(*statement.expr);
    Emit(Opcode::kStoreLocal, {statement.rest});
    // Each round takes the first of those that are left, if there is one. Those that have told
    // their fields are looked for anew, as neighbours may go while a round waits.
    Target next, end;
    Place(&next, true);
    EmitFirstOf(statement.rest, statement.role);
    Emit(Opcode::kStoreLocal, {statement.index});
    Emit(Opcode::kLoadLocal, {statement.index}, {.type = vm::ValueType::kSet});
    EmitJumpIfEmpty(&end);
    loops_.push_back({&next, &end});
    EmitBranch(*statement.body[0]);
    loops_.pop_back();
    if (reachable) {
      MarkLine(statement.span);
      Jump(Opcode::kJump, &next);
    }
    Place(&end);
    set_locals = outer;
  }

  // Where `continue` and `break` go in the loop that is being emitted.
  struct Loop {
    Target* next;  ///< Null in a switch that is in no loop.
    Target* end;
  };

  const Routine& routine_;
  std::vector<Loop> loops_;  // The innermost last, switches among them.
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

// Parameters stand first in the table of constants, in declared order.
void AddParameters(const ProgramModel& model, ProgramCode* code, source::Diagnostics* diagnostics) {
  for (size_t i = 0; i < model.constants.size(); ++i) {
    if (!model.constants[i].is_parameter()) continue;
    const int number = code->constants.NumberOf(EntryOf(model, static_cast<int>(i)));
    if (number < vm::image::kMaxParameters) continue;
    diagnostics->Error(model.constants[i].span, "too many parameters in one program").hint =
        "at most " + std::to_string(vm::image::kMaxParameters);
    return;
  }
}

// Periods follow them, since handlers name them by seven bits.
void AddPeriods(const ProgramModel& model, ProgramCode* code, source::Diagnostics* diagnostics) {
  code->periods.assign(model.routines.size(), -1);
  for (size_t i = 0; i < model.routines.size(); ++i) {
    const Member& member = *model.routines[i].member;
    if (member.period == nullptr) continue;
    // Equal periods share a constant, so that many timers need few of them.
    const uint32_t bits = vm::Cell::Float(member.period_s).bits;
    code->periods[i] = code->constants.NumberOf(member.period_parameter >= 0
                                                    ? EntryOf(model, member.period_parameter)
                                                    : ConstantEntry{vm::ValueType::kFloat, bits});
    if (code->periods[i] < vm::image::kMaxPeriods) continue;
    diagnostics->Error(member.period->span, "too many different periods in one program").hint =
        "at most " + std::to_string(vm::image::kMaxPeriods) + ", parameters included";
    return;
  }
}

}  // namespace

ProgramCode Generate(const source::SourceSet& sources, const ProgramModel& model,
                     source::Diagnostics* diagnostics) {
  ProgramCode code;
  // One table of constants serves the whole program.
  AddParameters(model, &code, diagnostics);
  AddPeriods(model, &code, diagnostics);
  for (const Routine& routine : model.routines) {
    // Each routine is translated by itself; calls go by slots, so that no order matters.
    FunctionGenerator generator(sources, routine, &code);
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
  if (code.constants.all().size() > 65535) {
    diagnostics->Error(model.routines[0].member->name_span, "too many constants in one program");
  }
  return code;
}

}  // namespace morphbus::dynarole
