#include "compiler/dynarole/statement_checker.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "compiler/dynarole/constants.h"
#include "compiler/dynarole/statement_flow.h"
#include "vm/image/fault_text.h"

namespace morphbus::dynarole {

using source::Diagnostic;

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
      assignments_.CheckAssign(statement);
      break;
    case StmtKind::kVar:
      assignments_.CheckVar(statement);
      break;
    case StmtKind::kReturn:
      CheckReturn(statement);
      break;
    case StmtKind::kIf:
      // A branch sees the locals from before the if, and keeps its own to itself.
      CheckCondition(statement->expr.get(), "if");
      for (StmtPtr& branch : statement->body) CheckScoped(branch.get());
      break;
    case StmtKind::kSwitch:
      CheckSwitch(statement);
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
    case StmtKind::kForEach:
      CheckForEach(statement);
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

void StatementChecker::CheckForEach(Stmt* statement) {
  // The parser has said that there is nothing to go over.
  if (statement->expr == nullptr) return;
  const Expr& set = *statement->expr;
  const Type type = InferSet(statement->expr.get());
  if (type != Type::kSet && type != Type::kError && type != Type::kUnknown) {
    pass_.Error(set.span, "a loop goes over a set of modules, but this is " + NameOf(type)).hint =
        "for example: for (" + statement->name + " in self.connected($ANY, $Role)) { ... }";
  }
  // The neighbours that are left are kept beside the one of the round; loops in the body keep
  // theirs elsewhere.
  const size_t scope = scope_.num_locals();
  statement->rest = scope_.Hidden("neighbours", set.span, Type::kSet, 1 + loops_);
  statement->meaning = Meaning::kLocal;
  statement->type = Type::kSet;
  statement->index = scope_.AddLocal(statement->name, statement->name_span, Type::kSet, false);
  if (Local* neighbour = scope_.FindLocal(statement->name)) {
    neighbour->neighbour = true;
    neighbour->role = expressions_.calls().RoleOf(set);
  }
  ++loops_;
  for (StmtPtr& body : statement->body) CheckScoped(body.get());
  --loops_;
  // Where fields are read, neighbours that have not told theirs have no round.
  const Local* neighbour = scope_.FindLocal(statement->name);
  const bool reads = neighbour != nullptr && neighbour->field_read;
  statement->role = reads ? neighbour->role : -1;
  scope_.Close(scope);
}

Type StatementChecker::InferSet(Expr* set) {
  const bool array =
      set->kind == ExprKind::kName && expressions_.arrays().Find(set->name).has_value();
  if (!array) return expressions_.Infer(set);
  set->type = pass_.Wrong(
      set->span, "a loop goes over a set of modules, but '" + set->name + "' is an array",
      "count its elements: for (var i = 0; i < sizeof(" + set->name + "); i += 1) { ... }");
  return set->type;
}

void StatementChecker::CheckSwitch(Stmt* statement) {
  // The parser has said that there is nothing to look at.
  if (statement->expr == nullptr) return;
  Expr* value = statement->expr.get();
  Type type = expressions_.Infer(value);
  // A parameter is of the type of the first value that it is tried against, if nothing better is
  // known about it.
  if (type == Type::kUnknown && pass_.phase() == Phase::kDefaults) {
    for (const SwitchCase& one : statement->cases) {
      if (one.is_default() || value->type != Type::kUnknown) continue;
      expressions_.conversions().Hint(value, expressions_.Infer(one.values[0].get()));
    }
  }
  if (type == Type::kAny) type = Type::kDirection;
  // A set is looked at by its size, as in comparisons.
  const bool counts = IsSet(type);
  if (counts) {
    value->wanted = Type::kInt;
    type = Type::kInt;
  }
  const bool known = type != Type::kError && type != Type::kUnknown;
  if (known && type != Type::kInt && type != Type::kBool && type != Type::kDirection &&
      type != Type::kAxis && type != Type::kRole) {
    pass_.Error(value->span, "'switch' cannot look at " + NameOf(type)).hint =
        type == Type::kFloat
            ? "floats are compared by 'if', or made ints by round(...) or floor(...)"
            : "it looks at ints, bools, directions, axes and roles";
    type = Type::kError;
  }
  if (known && !counts) expressions_.conversions().Want(value, type, "what 'switch' looks at");
  // The value is kept, as its cases are tried one after the other, unless it is kept already.
  const bool kept = value->meaning == Meaning::kLocal && value->kind == ExprKind::kName;
  statement->meaning = kept ? Meaning::kLocal : Meaning::kNone;
  statement->index = kept ? value->index : scope_.Hidden("switch", value->span, type);
  statement->type = type;
  CheckCases(statement, type);
  ++switches_;
  for (StmtPtr& block : statement->body) CheckScoped(block.get());
  --switches_;
  if (pass_.is_final()) CheckLeftOut(*statement);
}

void StatementChecker::CheckCases(Stmt* statement, Type type) {
  std::map<uint32_t, source::Span> seen;
  const SwitchCase* otherwise = nullptr;
  for (const SwitchCase& one : statement->cases) {
    if (one.is_default() && otherwise != nullptr) {
      pass_.Error(one.span, "a switch has one 'default'").Note(otherwise->span, "the first one");
    }
    if (one.is_default()) otherwise = &one;
    for (const ExprPtr& value : one.values) {
      expressions_.InferAs(value.get(), type, "the value of a case");
      if (value->type == Type::kError || value->type == Type::kUnknown) continue;
      const FoldResult folded = Fold(*value);
      if (folded.fault != vm::FaultCode::kNone) {
        pass_.Error(value->span, std::string("the value of a case cannot be computed: ") +
                                     vm::FaultName(folded.fault));
        continue;
      }
      if (!folded.value) {
        pass_.Error(value->span, "the value of a case must be known at compile time").hint =
            "what is found out as the program runs is compared by 'if'";
        continue;
      }
      const auto [place, fresh] = seen.try_emplace(folded.value->cell.bits, value->span);
      if (fresh) continue;
      pass_.Error(value->span, "this value has a case already").Note(place->second, "here");
    }
  }
  if (statement->cases.empty()) pass_.Warning(statement->span, "switch without any case");
}

void StatementChecker::CheckLeftOut(const Stmt& statement) {
  // Only where all values are those of one enumeration it is clear what is meant.
  int enumeration = -1;
  std::set<uint32_t> seen;
  for (const SwitchCase& one : statement.cases) {
    if (one.is_default()) return;
    for (const ExprPtr& value : one.values) {
      const bool named = value->kind == ExprKind::kName || value->kind == ExprKind::kMember;
      const int constant = named && value->meaning == Meaning::kConstant ? value->index : -1;
      const int of = constant < 0 ? -1 : model_.constants[constant].enumeration;
      if (of < 0 || (enumeration >= 0 && of != enumeration)) return;
      enumeration = of;
      seen.insert(value->cell.bits);
    }
  }
  std::string left_out;
  for (const ConstantModel& constant : model_.constants) {
    if (enumeration < 0 || constant.enumeration != enumeration) continue;
    if (seen.contains(constant.cell.bits)) continue;
    left_out += (left_out.empty() ? "" : ", ") + constant.name;
  }
  if (left_out.empty()) return;
  pass_
      .Warning(statement.expr->span, "this switch leaves out " + left_out + " of '" +
                                         model_.program->enumerations[enumeration].name + "'")
      .hint = "give it a case, or write 'default:' for all that is left";
}

void StatementChecker::CheckLeave(const Stmt& statement) {
  if (loops_ > 0 || (switches_ > 0 && statement.kind == StmtKind::kBreak)) return;
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

}  // namespace morphbus::dynarole
