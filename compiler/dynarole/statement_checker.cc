#include "compiler/dynarole/statement_checker.h"

#include <algorithm>
#include <optional>

#include "compiler/dynarole/constants.h"

namespace morphbus::dynarole {

using source::Diagnostic;

namespace {

// True if the expression is a loop's condition that never fails.
bool IsAlwaysTrue(const Expr& condition) {
  // What rests on a field or variable may change while the program runs, and is not folded.
  const FoldResult folded = Fold(condition);
  return folded.value && folded.value->type == Type::kBool && folded.value->cell.AsBool();
}

// A `break` leaves the innermost loop around it only.
bool Breaks(const Stmt& statement) {
  if (statement.kind == StmtKind::kBreak) return true;
  if (statement.kind == StmtKind::kWhile || statement.kind == StmtKind::kFor) return false;
  return std::any_of(statement.body.begin(), statement.body.end(),
                     [](const StmtPtr& inner) { return Breaks(*inner); });
}

}  // namespace

void StatementChecker::CheckBlock(Stmt* block) {
  // The names of the block end with it; those around it stay.
  const size_t scope = scope_.num_locals();
  bool warned = false;
  for (size_t i = 0; i < block->body.size(); ++i) {
    CheckStatement(block->body[i].get());
    // One warning a block is enough; the rest of it is not reached either.
    if (!warned && i + 1 < block->body.size() && AlwaysReturns(*block->body[i])) {
      pass_.Warning(block->body[i + 1]->span, "statement is never reached");
      warned = true;
    }
  }
  // Parameters belong to the routine; CheckRoutine closes their scope.
  scope_.Close(std::max(scope, scope_.routine()->member->parameters.size()));
}

// What an if or while holds is a scope of its own, braces or not.
void StatementChecker::CheckStatement(Stmt* statement) {
  switch (statement->kind) {
    case StmtKind::kBlock:
      CheckBlock(statement);
      break;
    case StmtKind::kExpr:
      CheckExprStatement(statement);
      break;
    case StmtKind::kAssign:
      CheckAssign(statement);
      break;
    case StmtKind::kVar:
      CheckVar(statement);
      break;
    case StmtKind::kReturn:
      CheckReturn(statement);
      break;
    case StmtKind::kIf:
      // A branch sees the locals from before the if, and keeps its own to itself.
      CheckCondition(statement->expr.get(), "if");
      for (StmtPtr& branch : statement->body) CheckScoped(branch.get());
      break;
    case StmtKind::kWhile:
      CheckCondition(statement->expr.get(), "while");
      ++loops_;
      for (StmtPtr& body : statement->body) CheckScoped(body.get());
      --loops_;
      break;
    case StmtKind::kFor:
      CheckFor(statement);
      break;
    case StmtKind::kBreak:
    case StmtKind::kContinue:
      CheckLeave(*statement);
      break;
    // It has been reported where it was parsed.
    case StmtKind::kError:
      break;
  }
}

void StatementChecker::CheckScoped(Stmt* statement) {
  const size_t scope = scope_.num_locals();
  CheckStatement(statement);
  scope_.Close(scope);
}

void StatementChecker::CheckFor(Stmt* statement) {
  // The variable of the head is seen in all of the loop and nowhere behind it.
  const size_t scope = scope_.num_locals();
  CheckStatement(statement->body[0].get());
  CheckCondition(statement->expr.get(), "for");
  ++loops_;
  // The step is checked behind the body, as it runs behind it; neither sees the names of the other.
  CheckScoped(statement->body[2].get());
  --loops_;
  CheckStatement(statement->body[1].get());
  scope_.Close(scope);
}

void StatementChecker::CheckLeave(const Stmt& statement) {
  if (loops_ > 0) return;
  // The generator would have no place to jump to.
  const std::string word = statement.kind == StmtKind::kBreak ? "break" : "continue";
  pass_.Error(statement.span, "'" + word + "' stands outside all loops").hint =
      "it leaves a 'while' or 'for' that is around it; to leave the function write 'return;'";
}

void StatementChecker::CheckCondition(Expr* condition, const char* word) {
  // A `for` without a condition goes on until it is left.
  if (condition == nullptr) return;
  expressions_.InferAs(condition, Type::kBool, std::string("the condition of '") + word + "'");
}

void StatementChecker::CheckExprStatement(Stmt* statement) {
  if (statement->expr == nullptr) return;
  // Only calls do something; a value that nobody uses is a slip.
  Expr& expr = *statement->expr;
  const Type type = expressions_.Infer(&expr);
  // What is wrong has been reported.
  if (type == Type::kError || expr.kind == ExprKind::kError) return;
  if (expr.kind != ExprKind::kCall) {
    Diagnostic& warning = pass_.Warning(expr.span, "statement has no effect");
    // The two likeliest slips get a hint.
    if (expr.kind == ExprKind::kBinary && expr.op == Operator::kEqual) {
      warning.hint = "to assign, write '='";
    } else if (expr.kind == ExprKind::kName || expr.kind == ExprKind::kMember) {
      warning.hint = "to call it, write parentheses after it";
    }
  }
}

void StatementChecker::CheckVar(Stmt* statement) {
  // The parser has said that the first value is missing.
  if (statement->expr == nullptr) return;
  // The first value gives the variable its type for good.
  Type type = expressions_.Infer(statement->expr.get());
  if (type == Type::kAny) type = Type::kDirection;
  if (type == Type::kVoid) {
    pass_.Error(statement->expr->span,
                "this has no value that '" + statement->name + "' could take");
    type = Type::kError;
  }
  // A message about what the type follows from is worth more than this one.
  if (type == Type::kUnknown && pass_.is_final() && !pass_.had_errors()) {
    pass_.Error(statement->name_span, "cannot tell the type of '" + statement->name + "'");
  }
  // The value itself is converted too: a $ANY that stands alone becomes a direction.
  expressions_.conversions().Want(statement->expr.get(), type,
                                  "the variable '" + statement->name + "'");
  statement->meaning = Meaning::kLocal;
  statement->type = type;
  statement->index = scope_.AddLocal(statement->name, statement->name_span, type, false);
}

void StatementChecker::CheckAssign(Stmt* statement) {
  Expr* value = statement->expr.get();
  // The value comes first, since its type may tell that of a parameter.
  if (!FindTarget(statement, expressions_.Infer(value))) {
    UnknownTarget(*statement);
    return;
  }
  // `+=` and its kin compute, so they need numbers.
  const Type target = statement->type;
  if (statement->op != Operator::kNone && !IsNumber(target) && target != Type::kError &&
      target != Type::kUnknown) {
    pass_.Error(statement->name_span, "'" + NameOf(statement->op) + "=' needs a number, but '" +
                                          statement->name + "' is " + NameOf(target));
    return;
  }
  // The target keeps its type, whatever the value is: an int becomes a float, and never the other
  // way.
  expressions_.conversions().Want(value, target, "'" + statement->name + "'");
}

bool StatementChecker::FindTarget(Stmt* statement, Type type) {
  Routine& routine = *scope_.routine();
  statement->type = Type::kError;
  // Variables and parameters hide fields, as where names are read.
  if (const Local* local = scope_.FindLocal(statement->name)) {
    statement->meaning = Meaning::kLocal;
    statement->index = local->slot;
    statement->type = routine.locals[local->slot];
    // An assignment tells the type of a parameter as a call would.
    if (statement->type == Type::kUnknown && local->parameter) {
      pass_.Settle(&scope_.signature().parameters[local->slot], type);
    }
    return true;
  }
  const RoleModel& owner = scope_.role();
  const int slot = model_.FindField(owner, statement->name);
  // Constants and labels are known names, too, but nothing can be assigned to them.
  if (slot < 0) return false;
  statement->meaning = Meaning::kField;
  statement->index = slot;
  statement->type = model_.fields[owner.fields[slot].decl].type;
  // To set a field is to act: requirements and labels may not.
  routine.effect = std::max(routine.effect, vm::Effect::kTask);
  return true;
}

void StatementChecker::UnknownTarget(const Stmt& statement) {
  // The name may be one that stands for a value which nothing changes.
  const int constant = model_.FindConstant(scope_.role_index(), statement.name);
  if (constant >= 0) {
    pass_
        .Error(statement.name_span, model_.constants[constant].Kind() + " '" + statement.name +
                                        "' cannot be assigned to")
        .Note(model_.constants[constant].span, "declared here");
    return;
  }
  const RoleModel& owner = scope_.role();
  if (FindSlot(owner.labels, statement.name) >= 0) {
    pass_.Error(statement.name_span, "label '" + statement.name + "' cannot be assigned to");
    return;
  }
  // What a role inherits from one that does not exist is not known.
  if (owner.broken) return;
  pass_.Suggest(
      &pass_.Error(statement.name_span, "unknown variable or field '" + statement.name + "'"),
      statement.name, scope_.Names(), "",
      "to make a variable, write: var " + statement.name + " = ...;");
}

void StatementChecker::CheckReturn(Stmt* statement) {
  Signature& signature = scope_.signature();
  // A return without a value must not stand beside one with a value.
  if (statement->expr == nullptr) {
    if (signature.result != Type::kVoid && signature.result != Type::kUnknown) {
      pass_.Error(statement->span, "'return' without the result that other ways return").hint =
          "the function returns " + NameOf(signature.result);
    }
    return;
  }
  // Startups, behaviors, commands and handlers return nothing, as nobody waits for it.
  Type type = expressions_.Infer(statement->expr.get());
  if (scope_.routine()->kind != MemberKind::kFunction) {
    pass_.Error(statement->expr->span, "a " + NameOf(scope_.routine()->kind) + " has no result")
        .hint = "write 'return;'; only functions return values";
    return;
  }
  if (type == Type::kAny) type = Type::kDirection;
  if (type == Type::kVoid) {
    pass_.Error(statement->expr->span, "this has no value to return");
    return;
  }
  // A set is returned as the one member that it must have.
  if (type == Type::kJointSet || type == Type::kLinkSet) {
    type = type == Type::kJointSet ? Type::kJoint : Type::kLink;
  }
  // The first value decides; a function that returns both ints and floats returns floats.
  if (!pass_.is_final()) {
    if (signature.result == Type::kVoid) {
      if (type != Type::kUnknown && type != Type::kError) pass_.Change(&signature.result, type);
    } else if (const std::optional<Type> joined = Join(signature.result, type)) {
      pass_.Change(&signature.result, *joined);
    }
    return;
  }
  // All types are settled by now, so that a value which does not fit is an error.
  expressions_.conversions().Want(statement->expr.get(), signature.result, "the function's result");
}

// Whether what follows the statement is never reached.
bool StatementChecker::AlwaysReturns(const Stmt& statement) {
  switch (statement.kind) {
    case StmtKind::kReturn:
    case StmtKind::kBreak:
    case StmtKind::kContinue:
      return true;
    case StmtKind::kBlock:
      // One statement that never ends normally is enough.
      for (const StmtPtr& inner : statement.body) {
        if (AlwaysReturns(*inner)) return true;
      }
      return false;
    case StmtKind::kIf:
      // Without an else there is a way past the branch.
      return statement.body.size() == 2 && AlwaysReturns(*statement.body[0]) &&
             AlwaysReturns(*statement.body[1]);
    case StmtKind::kWhile:
      // Only a return leaves a loop without end that nothing breaks.
      return statement.expr != nullptr && IsAlwaysTrue(*statement.expr) &&
             !Breaks(*statement.body[0]);
    case StmtKind::kFor:
      return (statement.expr == nullptr || IsAlwaysTrue(*statement.expr)) &&
             !Breaks(*statement.body[2]);
    default:
      return false;
  }
}

}  // namespace morphbus::dynarole
