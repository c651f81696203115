#include "compiler/dynarole/assignment_checker.h"

#include <algorithm>
#include <optional>
#include <string>

namespace morphbus::dynarole {

void AssignmentChecker::CheckVar(Stmt* statement) {
  // The parser has said that the first value is missing.
  if (statement->expr == nullptr) return;
  if (statement->expr->kind == ExprKind::kArray || statement->length > 0) {
    return CheckArray(statement);
  }
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

void AssignmentChecker::CheckArray(Stmt* statement) {
  Expr* values = statement->expr.get();
  const bool listed = values->kind == ExprKind::kArray;
  const int length = listed ? static_cast<int>(values->operands.size()) : statement->length;
  if (listed && statement->length > 0 && statement->length != length) {
    pass_
        .Error(values->span, "'" + statement->name + "' has " + std::to_string(statement->length) +
                                 " elements, but these are " + std::to_string(length))
        .hint = "without a number behind its name it has as many as there are values";
  }
  if (listed) {
    for (ExprPtr& value : values->operands) expressions_.Infer(value.get());
  } else {
    expressions_.Infer(values);
  }
  // All elements are of the type that fits all first values.
  Type type = listed ? expressions_.arrays().InferValues(values) : values->type;
  if (type == Type::kAny) type = Type::kDirection;
  if (type == Type::kVoid) {
    pass_.Error(values->span, "this has no value that elements could take");
    type = Type::kError;
  }
  if (type == Type::kUnknown && pass_.is_final() && !pass_.had_errors()) {
    pass_.Error(statement->name_span, "cannot tell the type of '" + statement->name + "'");
  }
  const auto want = [&](Expr* value) {
    expressions_.conversions().Want(value, type, "an element of '" + statement->name + "'");
  };
  if (listed) {
    for (ExprPtr& value : values->operands) want(value.get());
  } else {
    want(values);
  }
  statement->meaning = Meaning::kLocal;
  statement->type = type;
  statement->length = length;
  statement->index = scope_.AddArray(statement->name, statement->name_span, type, length);
}

void AssignmentChecker::CheckAssign(Stmt* statement) {
  Expr* value = statement->expr.get();
  // The value comes first, since its type may tell that of a parameter.
  if (!FindTarget(statement, expressions_.Infer(value))) {
    UnknownTarget(*statement);
    return;
  }
  CheckSubscript(statement);
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

bool AssignmentChecker::FindTarget(Stmt* statement, Type type) {
  Routine& routine = *scope_.routine();
  statement->type = Type::kError;
  // An element of an array, or a name that should have been one.
  ArrayChecker& arrays = expressions_.arrays();
  if (statement->subscript != nullptr) expressions_.Infer(statement->subscript.get());
  if (const std::optional<Array> array = arrays.Find(statement->name)) {
    if (statement->subscript == nullptr) {
      arrays.AsValue(statement->name_span, statement->name, *array);
      return true;
    }
    arrays.FindElement(*array, statement);
    if (array->meaning == Meaning::kField) {
      routine.effect = std::max(routine.effect, vm::Effect::kTask);
    }
    return true;
  }
  // Variables and parameters hide fields, as where names are read.
  if (const Local* local = scope_.FindLocal(statement->name)) {
    statement->meaning = Meaning::kLocal;
    statement->index = local->slot;
    statement->type = routine.locals[local->slot];
    if (local->neighbour) {
      pass_
          .Error(statement->name_span, "'" + statement->name +
                                           "' is the neighbour of this round, and cannot be "
                                           "assigned to")
          .Note(local->span, "declared here");
      statement->type = Type::kError;
      return true;
    }
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

void AssignmentChecker::CheckSubscript(Stmt* statement) {
  if (statement->subscript == nullptr || statement->length > 0) return;
  expressions_.arrays().NoArray(statement->name_span, statement->name, statement->type);
  statement->type = Type::kError;
}

void AssignmentChecker::UnknownTarget(const Stmt& statement) {
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

}  // namespace morphbus::dynarole
