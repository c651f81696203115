#include <algorithm>

#include "compiler/dynarole/checker.h"
#include "compiler/dynarole/constants.h"
#include "compiler/dynarole/print_call.h"

namespace morphbus::dynarole {

using source::Diagnostic;

namespace {

/// The image has the length of a text in one byte.
constexpr size_t kLongestPrint = 255;

}  // namespace

// Functions of the language stand behind those of the role, so that a program may have its own.
std::optional<Type> Checker::InferFunction(Expr* call) {
  Expr* callee = call->operands[0].get();
  if (UsagesOf(FunctionBuiltins(), callee->name).empty()) return std::nullopt;
  return ApplyBuiltin(FunctionBuiltins(), "", callee, call);
}

Type Checker::InferPrint(Expr* call) {
  // Texts and values may come in any order; texts have no type, so that only values are inferred.
  call->meaning = Meaning::kBuiltin;
  call->opcode = vm::Opcode::kPrint;
  Uses(call->opcode, call->name_span, "print");
  int values = 0;
  if (call->operands.size() == 1) Error(call->span, "'print' has nothing to print");
  for (size_t i = 1; i < call->operands.size(); ++i) {
    Expr* value = call->operands[i].get();
    if (value->kind == ExprKind::kText) continue;
    ++values;
    const Type type = Infer(value);
    // A set is told by its size, as in comparisons.
    if (IsSet(type)) value->wanted = Type::kInt;
    if (type == Type::kAny) value->wanted = Type::kDirection;
    if (type == Type::kVoid) Error(value->span, "this has no value to print");
  }
  if (values > vm::kMaxPrintValues) {
    Error(call->span, "'print' has " + std::to_string(values) + " values").hint =
        "at most " + std::to_string(vm::kMaxPrintValues) + " in one line";
  }
  // The places of values in the image take three characters each.
  if (PrintTextOf(*call).size() > kLongestPrint) {
    Error(call->span, "the text to print is too long").hint =
        "at most " + std::to_string(kLongestPrint) + " characters in one line";
  }
  return Type::kVoid;
}

// The role is what `$Role` says, since the fields and commands of neighbours are those of a role.
Type Checker::InferNeighbours(Expr* member, Expr* call) {
  const Expr& set = *member->operands[0];
  const bool of_role = set.meaning == Meaning::kBuiltin && set.opcode == vm::Opcode::kConnectedRole;
  const FoldResult folded = of_role ? Fold(*set.operands[2]) : FoldResult();
  if (!folded.value || folded.value->type != Type::kRole) {
    return Wrong(member->span, "which role the neighbours play is not known here",
                 "write self.connected(direction, $Role)." + member->name);
  }
  const int role = folded.value->cell.AsInt();
  if (call != nullptr) return InferInvoke(member, call, role, Meaning::kInvokeNear);
  // Without parentheses it is a field, which its role must share.
  const RoleModel& target = model_.roles[role];
  const int slot = model_.FindField(target, member->name);
  if (slot < 0) {
    if (target.broken) return Type::kError;
    // The nearest name among the shared ones is suggested, or all of them if none is near.
    std::vector<std::string> names;
    for (const FieldSlot& field : target.fields) {
      if (model_.fields[field.decl].shared) names.push_back(model_.fields[field.decl].name);
    }
    Diagnostic& error =
        Error(member->name_span, "role '" + target.name + "' has no field '" + member->name + "'");
    std::string shared;
    for (const std::string& name : names) shared += (shared.empty() ? "it shares " : ", ") + name;
    Suggest(&error, member->name, names, "", shared);
    if (FindSlot(target.commands, member->name) >= 0) {
      error.hint = "commands are called: write " + member->name + "(...)";
    }
    return Type::kError;
  }
  FieldDecl& decl = model_.fields[target.fields[slot].decl];
  if (!decl.shared) {
    Error(member->name_span, "field '" + decl.name + "' is not shared")
        .Hint("neighbours may read it if it is declared so: shared " + decl.name + " = ...;")
        .Note(decl.span, "declared here");
    return Type::kError;
  }
  // A field that only neighbours read is not unused.
  decl.read = true;
  member->meaning = Meaning::kNeighbourField;
  member->role = role;
  member->index = slot;
  Uses(vm::Opcode::kNeighbourField, member->name_span, "a neighbour's " + member->name);
  return decl.type;
}

Type Checker::InferSuper(Expr* member, Expr* call) {
  // Only a member with a body replaces something that runs.
  if (routine_ == nullptr || routine_->signature < 0) {
    return Wrong(member->span, "'super' stands only in members that run");
  }
  const Member& own = *routine_->member;
  if (member->name != own.name) {
    return Wrong(
        member->name_span,
        "'super' calls what this " + NameOf(routine_->kind) + " replaces, which is '" + own.name +
            "'",
        "write super." + own.name + "(...); functions of other names are called without it");
  }
  // What the role above has under the name, be it its own or inherited.
  const int parent = model_.roles[role_].parent;
  const int slot =
      parent < 0 ? -1 : FindSlot(*SlotsOf(&model_.roles[parent], routine_->kind), own.name);
  if (slot < 0) {
    if (model_.roles[role_].broken) return Type::kError;
    return Wrong(member->span, NameOf(routine_->kind) + " '" + own.name + "' replaces nothing",
                 "no role that '" + model_.roles[role_].name + "' extends has one of that name");
  }
  if (call == nullptr) {
    return Wrong(member->span, "'super." + own.name + "' must be called",
                 "write super." + own.name + "(...)");
  }
  // The callee is known here, however far roles are extended later: super never dispatches.
  const int callee = (*SlotsOf(&model_.roles[parent], routine_->kind))[slot].routine;
  call->meaning = Meaning::kSuper;
  call->index = callee;
  routine_->calls.push_back({-1, member->name_span, callee});
  const int signature = model_.routines[callee].signature;
  CheckArguments(call, signature, NameOf(routine_->kind) + " '" + own.name + "'");
  // A function's result may only be found in a later round, as that of any call.
  const Type result = model_.signatures[signature].result;
  const bool unknown = routine_->kind == MemberKind::kFunction && result == Type::kVoid;
  return unknown && phase_ != Phase::kFinal ? Type::kUnknown : result;
}

}  // namespace morphbus::dynarole
