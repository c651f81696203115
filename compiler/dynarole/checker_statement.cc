#include <algorithm>

#include "compiler/dynarole/checker.h"
#include "compiler/dynarole/constants.h"
#include "vm/image/image.h"

namespace morphbus::dynarole {

using source::Diagnostic;
using source::Span;

namespace {

// True if the expression is a loop's condition that never fails.
bool IsAlwaysTrue(const Expr& condition) {
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

int Checker::AddLocal(const std::string& name, const Span& span, Type type, bool parameter) {
  // A name is declared once in a scope and all scopes around it.
  if (const Local* before = FindLocal(name)) {
    Error(span, "'" + name + "' is declared twice").Note(before->span, "first declared here");
  } else if (routine_->locals.size() == vm::image::kMaxLocals) {
    Error(span, "too many variables and parameters").hint =
        "at most " + std::to_string(vm::image::kMaxLocals) + "; split it into functions";
  }
  // One more than fits is enough to say so; the rest would only cost time.
  if (routine_->locals.size() > vm::image::kMaxLocals) {
    return static_cast<int>(routine_->locals.size()) - 1;
  }
  // Slots are never used again, so that the verifier can give each one type.
  Local local;
  local.name = name;
  local.span = span;
  local.slot = static_cast<int>(routine_->locals.size());
  local.parameter = parameter;
  local.used = FindLocal(name) != nullptr;  // One complaint is enough.
  locals_.push_back(std::move(local));
  routine_->locals.push_back(type);
  routine_->local_names.push_back(name);
  return static_cast<int>(routine_->locals.size()) - 1;
}

// Names are unique among the locals in scope, so the first one found is the only one.
Checker::Local* Checker::FindLocal(const std::string& name) {
  for (Local& local : locals_) {
    if (local.name == name) return &local;
  }
  return nullptr;
}

void Checker::CloseScope(size_t size) {
  for (size_t i = size; i < locals_.size(); ++i) {
    if (!locals_[i].used && !locals_[i].parameter) {
      Warning(locals_[i].span, "variable '" + locals_[i].name + "' is never used");
    }
  }
  locals_.resize(std::min(size, locals_.size()));
}

void Checker::CheckScoped(Stmt* statement) {
  const size_t scope = locals_.size();
  CheckStatement(statement);
  CloseScope(scope);
}

void Checker::CheckBlock(Stmt* block) {
  const size_t scope = locals_.size();
  bool warned = false;
  for (size_t i = 0; i < block->body.size(); ++i) {
    CheckStatement(block->body[i].get());
    // One warning a block is enough; the rest of it is not reached either.
    if (!warned && i + 1 < block->body.size() && AlwaysReturns(*block->body[i])) {
      Warning(block->body[i + 1]->span, "statement is never reached");
      warned = true;
    }
  }
  // Parameters belong to the routine; CheckRoutine closes their scope.
  CloseScope(std::max(scope, routine_->member->parameters.size()));
}

// What an if or while holds is a scope of its own, braces or not.
void Checker::CheckStatement(Stmt* statement) {
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
    case StmtKind::kError:
      break;
  }
}

void Checker::CheckFor(Stmt* statement) {
  // The variable of the head is seen in all of the loop and nowhere behind it.
  const size_t scope = locals_.size();
  CheckStatement(statement->body[0].get());
  CheckCondition(statement->expr.get(), "for");
  ++loops_;
  CheckScoped(statement->body[2].get());
  --loops_;
  CheckStatement(statement->body[1].get());
  CloseScope(scope);
}

void Checker::CheckLeave(const Stmt& statement) {
  if (loops_ > 0) return;
  const std::string word = statement.kind == StmtKind::kBreak ? "break" : "continue";
  Error(statement.span, "'" + word + "' stands outside all loops").hint =
      "it leaves a 'while' or 'for' that is around it; to leave the function write 'return;'";
}

// Only a bool is a condition: no number and no set stands for one.
void Checker::CheckCondition(Expr* condition, const char* word) {
  if (condition == nullptr) return;
  Infer(condition);
  Want(condition, Type::kBool, std::string("the condition of '") + word + "'");
}

void Checker::CheckExprStatement(Stmt* statement) {
  if (statement->expr == nullptr) return;
  // Only calls do something; a value that nobody uses is a slip.
  Expr& expr = *statement->expr;
  const Type type = Infer(&expr);
  // What is wrong has been reported.
  if (type == Type::kError || expr.kind == ExprKind::kError) return;
  if (expr.kind != ExprKind::kCall) {
    Diagnostic& warning = Warning(expr.span, "statement has no effect");
    // The two likeliest slips get a hint.
    if (expr.kind == ExprKind::kBinary && expr.op == Operator::kEqual) {
      warning.hint = "to assign, write '='";
    } else if (expr.kind == ExprKind::kName || expr.kind == ExprKind::kMember) {
      warning.hint = "to call it, write parentheses after it";
    }
  }
}

void Checker::CheckVar(Stmt* statement) {
  if (statement->expr == nullptr) return;
  // The first value gives the variable its type for good.
  Type type = Infer(statement->expr.get());
  if (type == Type::kAny) type = Type::kDirection;
  if (type == Type::kVoid) {
    Error(statement->expr->span, "this has no value that '" + statement->name + "' could take");
    type = Type::kError;
  }
  // A message about what the type follows from is worth more than this one.
  if (type == Type::kUnknown && phase_ == Phase::kFinal && !diagnostics_.had_errors()) {
    Error(statement->name_span, "cannot tell the type of '" + statement->name + "'");
  }
  Want(statement->expr.get(), type, "the variable '" + statement->name + "'");
  statement->meaning = Meaning::kLocal;
  statement->type = type;
  statement->index = AddLocal(statement->name, statement->name_span, type, false);
}

void Checker::CheckAssign(Stmt* statement) {
  // What is assigned to: a variable or parameter, else a field of the role.
  Expr* value = statement->expr.get();
  const Type type = Infer(value);
  RoleModel& owner = Owner();
  Type target = Type::kError;
  if (const Local* local = FindLocal(statement->name)) {
    statement->meaning = Meaning::kLocal;
    statement->index = local->slot;
    target = routine_->locals[local->slot];
    // An assignment tells the type of a parameter as a call would.
    if (target == Type::kUnknown && local->parameter) {
      Signature& signature = model_.signatures[routine_->signature];
      Settle(&signature.parameters[local->slot], type);
    }
  } else {
    const int slot = model_.FindField(owner, statement->name);
    if (slot >= 0) {
      statement->meaning = Meaning::kField;
      statement->index = slot;
      target = model_.fields[owner.fields[slot].decl].type;
      routine_->effect = std::max(routine_->effect, vm::Effect::kTask);
    }
  }
  statement->type = target;
  // It is neither: perhaps a label, perhaps a slip, perhaps a variable that was never made.
  if (statement->meaning == Meaning::kNone) {
    if (const int constant = model_.FindConstant(role_, statement->name); constant >= 0) {
      Error(statement->name_span, "constant '" + statement->name + "' cannot be assigned to")
          .Note(model_.constants[constant].span, "declared here");
      return;
    }
    if (FindSlot(owner.labels, statement->name) >= 0) {
      Error(statement->name_span, "label '" + statement->name + "' cannot be assigned to");
      return;
    }
    if (owner.broken) return;
    Suggest(&Error(statement->name_span, "unknown variable or field '" + statement->name + "'"),
            statement->name, NamesInScope(), "",
            "to make a variable, write: var " + statement->name + " = ...;");
    return;
  }
  // `+=` and its kin compute, so they need numbers.
  if (statement->op != Operator::kNone && !IsNumber(target) && target != Type::kError &&
      target != Type::kUnknown) {
    Error(statement->name_span, "'" + NameOf(statement->op) + "=' needs a number, but '" +
                                    statement->name + "' is " + NameOf(target));
    return;
  }
  Want(value, target, "'" + statement->name + "'");
}

void Checker::CheckReturn(Stmt* statement) {
  Signature& signature = model_.signatures[routine_->signature];
  // A return without a value must not stand beside one with a value.
  if (statement->expr == nullptr) {
    if (signature.result != Type::kVoid && signature.result != Type::kUnknown) {
      Error(statement->span, "'return' without the result that other ways return").hint =
          "the function returns " + NameOf(signature.result);
    }
    return;
  }
  // Startups, behaviors, commands and handlers return nothing, as nobody waits for it.
  Type type = Infer(statement->expr.get());
  if (routine_->kind != MemberKind::kFunction) {
    Error(statement->expr->span, "a " + NameOf(routine_->kind) + " has no result").hint =
        "write 'return;'; only functions return values";
    return;
  }
  if (type == Type::kAny) type = Type::kDirection;
  if (type == Type::kVoid) {
    Error(statement->expr->span, "this has no value to return");
    return;
  }
  // A set is returned as the one member that it must have.
  if (type == Type::kJointSet || type == Type::kLinkSet) {
    type = type == Type::kJointSet ? Type::kJoint : Type::kLink;
  }
  // The first value decides; a function that returns both ints and floats returns floats.
  if (phase_ != Phase::kFinal) {
    if (signature.result == Type::kVoid) {
      if (type != Type::kUnknown && type != Type::kError) Change(&signature.result, type);
    } else if (const std::optional<Type> joined = Join(signature.result, type)) {
      Change(&signature.result, *joined);
    }
    return;
  }
  Want(statement->expr.get(), signature.result, "the function's result");
}

// Whether what follows the statement is never reached.
bool Checker::AlwaysReturns(const Stmt& statement) const {
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
