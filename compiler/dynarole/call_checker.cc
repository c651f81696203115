#include "compiler/dynarole/call_checker.h"

#include <algorithm>
#include <string>
#include <vector>

#include "compiler/base/text.h"
#include "compiler/dynarole/builtins.h"
#include "compiler/dynarole/constants.h"

namespace morphbus::dynarole {

using source::Diagnostic;
using source::Span;

Type CallChecker::InferMethod(Expr* call, const std::string& name, const Span& span, int slot) {
  // A value is computed by the compiler, which runs no code.
  if (scope_.routine() == nullptr)
    return pass_.Wrong(span, "value of a field must be known at compile time");
  // The result type is that of the signature, which all functions in the slot share; it is unknown
  // until a return with a value has been found.
  const RoleModel& owner = scope_.role();
  const Routine& callee = model_.routines[owner.methods[slot].routine];
  model_.signatures[callee.signature].called = true;
  call->meaning = Meaning::kMethod;
  call->index = slot;
  // Calls are collected, since only the whole program shows whether they end.
  scope_.routine()->calls.push_back({slot, span});
  CheckArguments(call, callee.signature, "function '" + name + "'");
  const Type result = model_.signatures[callee.signature].result;
  return result == Type::kVoid && !pass_.is_final() ? Type::kUnknown : result;
}

Type CallChecker::InferInvoke(Expr* member, Expr* call, int role, Meaning meaning) {
  // The command is looked up in the role that is named, not in the one that invokes it.
  const RoleModel& target = model_.roles[role];
  const int slot = FindSlot(target.commands, member->name);
  if (slot < 0) return UnknownCommand(*member, target);
  const int signature = model_.routines[target.commands[slot].routine].signature;
  // The slot is that of the role named: all its subroles have the command there.
  call->meaning = meaning;
  call->role = role;
  call->index = slot;
  CheckArguments(call, signature, "command '" + target.name + "." + member->name + "'");
  // Other modules are made to act, so that requirements may not do it.
  scope_.Uses(vm::Opcode::kInvoke, member->name_span, target.name + "." + member->name);
  return Type::kVoid;
}

Type CallChecker::UnknownCommand(const Expr& member, const RoleModel& target) {
  // The role may inherit the command from one that does not exist.
  if (target.broken) return Type::kError;
  Diagnostic& error = pass_.Error(
      member.name_span, "role '" + target.name + "' has no command '" + member.name + "'");
  // A slip, a command of another role, or a member that is no command.
  std::vector<std::string> names;
  for (const NamedSlot& command : target.commands) names.push_back(command.name);
  pass_.Suggest(&error, member.name, names);
  for (const RoleModel& other : model_.roles) {
    if (error.hint.empty() && FindSlot(other.commands, member.name) >= 0) {
      error.hint = "role '" + other.name + "' has one";
    }
  }
  for (const std::vector<NamedSlot>* table :
       {&target.methods, &target.startups, &target.behaviors, &target.handlers}) {
    if (FindSlot(*table, member.name) >= 0) {
      error.hint = "only what is declared with 'command' can be run from elsewhere";
    }
  }
  if (error.hint.empty()) {
    error.hint = names.empty() ? "it has none; declare it: command " + member.name + "() { ... }"
                               : "it has " + Listed(names);
  }
  return Type::kError;
}

int CallChecker::RoleOf(const Expr& set) const {
  // The neighbour of a loop's round plays what all that the loop goes over play.
  if (set.meaning == Meaning::kLocal && set.kind == ExprKind::kName) {
    const Local* local = scope_.FindLocal(set.name);
    return local == nullptr ? -1 : local->role;
  }
  // Else only a call that names a role, by a value known now, says it.
  const bool of_role = set.meaning == Meaning::kBuiltin && set.opcode == vm::Opcode::kConnectedRole;
  const FoldResult folded = of_role ? Fold(*set.operands[2]) : FoldResult();
  return folded.value && folded.value->type == Type::kRole ? folded.value->cell.AsInt() : -1;
}

// The role is what `$Role` says, since the fields and commands of neighbours are those of a role.
Type CallChecker::InferNeighbours(Expr* member, Expr* call) {
  const Expr& set = *member->operands[0];
  const int role = RoleOf(set);
  // What other languages call the size, unless the role has, or may inherit, something of that
  // name.
  const RoleModel* target = role < 0 ? nullptr : &model_.roles[role];
  const bool known =
      target != nullptr && (target->broken || model_.FindField(*target, member->name) >= 0 ||
                            FindSlot(target->commands, member->name) >= 0);
  if (!known && (member->name == "size" || member->name == "length" || member->name == "count")) {
    return pass_.Wrong(
        member->name_span, "a set of modules has no '" + member->name + "'",
        "how many neighbours there are is sizeof(SET), as in sizeof(self.connected)");
  }
  if (role < 0) {
    return pass_.Wrong(member->span, "which role the neighbours play is not known here",
                       scope_.IsNeighbour(set)
                           ? "let the loop go over self.connected(direction, $Role)"
                           : "write self.connected(direction, $Role)." + member->name);
  }
  return call != nullptr ? InferInvoke(member, call, role, Meaning::kInvokeNear)
                         : InferNeighbourField(member, role);
}

// Its role must share the field.
Type CallChecker::InferNeighbourField(Expr* member, int role) {
  const RoleModel& target = model_.roles[role];
  const int slot = model_.FindField(target, member->name);
  if (slot < 0) {
    if (target.broken) return Type::kError;
    // The nearest name among the shared ones is suggested, or all of them if none is near.
    std::vector<std::string> names;
    for (const FieldSlot& field : target.fields) {
      if (model_.fields[field.decl].shared) names.push_back(model_.fields[field.decl].name);
    }
    Diagnostic& error = pass_.Error(
        member->name_span, "role '" + target.name + "' has no field '" + member->name + "'");
    std::string shared;
    for (const std::string& name : names) shared += (shared.empty() ? "it shares " : ", ") + name;
    pass_.Suggest(&error, member->name, names, "", shared);
    // A command without parentheses is the likelier slip.
    if (FindSlot(target.commands, member->name) >= 0) {
      error.hint = "commands are called: write " + member->name + "(...)";
    }
    return Type::kError;
  }
  FieldDecl& decl = model_.fields[target.fields[slot].decl];
  // Only shared fields travel with what a module tells its neighbours.
  if (!decl.shared) {
    pass_.Error(member->name_span, "field '" + decl.name + "' is not shared")
        .Hint("neighbours may read it if it is declared so: shared " + decl.name + " = ...;")
        .Note(decl.span, "declared here");
    return Type::kError;
  }
  // A field that only neighbours read is not unused.
  decl.read = true;
  member->meaning = Meaning::kNeighbourField;
  member->role = role;
  member->index = slot;
  const Expr& set = *member->operands[0];
  Local* local = set.meaning == Meaning::kLocal ? scope_.FindLocal(set.name) : nullptr;
  if (local != nullptr) local->field_read = true;
  scope_.Uses(vm::Opcode::kNeighbourField, member->name_span, "a neighbour's " + member->name);
  return decl.type;
}

bool CallChecker::IsOverNeighbours(const Expr& call) {
  const std::string& name = call.operands[0]->name;
  if (UsagesOf(NeighbourBuiltins(), name).empty()) return false;
  if (UsagesOf(FunctionBuiltins(), name).empty()) return true;
  // Of two numbers `min` and `max` are functions of the language. What is wrong with the one
  // argument has been said, so that it may have been meant as a field.
  return call.operands.size() == 2 && (call.operands[1]->meaning == Meaning::kNeighbourField ||
                                       call.operands[1]->type == Type::kError);
}

Type CallChecker::InferOverNeighbours(Expr* call) {
  const std::string& name = call->operands[0]->name;
  const bool counts = name == "count", decides = name == "any" || name == "all";
  const Type result = counts ? Type::kInt : decides ? Type::kBool : Type::kError;
  if (call->operands.size() != 2) {
    pass_.Error(call->span, "'" + name + "' takes 1 argument, not " +
                                std::to_string(call->operands.size() - 1));
    return result;
  }
  Expr* asked = call->operands[1].get();
  if (asked->type == Type::kError) return result;
  // What is not known yet is no error: whoever wants to know it now says so.
  if (asked->type == Type::kUnknown) return result == Type::kError ? Type::kUnknown : result;
  // `count` of a set is the number of those that have told their fields.
  const bool of_set = counts && asked->type == Type::kSet;
  const int role = of_set ? RoleOf(*asked) : asked->role;
  if (of_set && role < 0) {
    // Where the role itself is wrong, that has been said.
    const auto wrong = [](const ExprPtr& operand) { return operand->type == Type::kError; };
    if (std::ranges::any_of(asked->operands, wrong)) return result;
    pass_.Error(asked->span, "'count' counts the neighbours that play a role and share fields")
        .Hint(
            "name it: count(self.connected(direction, $Role)); for how many neighbours there "
            "are write sizeof(...)");
    return result;
  }
  if (asked->meaning != Meaning::kNeighbourField && !of_set) {
    pass_.Error(asked->span, "'" + name + "' goes over a field that neighbours share")
        .Hint("for example: " + name + "(self.connected($ANY, $Role).field)");
    return result;
  }
  // Sums and extremes are of numbers, what any or all have and `count` of those that have it of
  // bools.
  const bool wants_bool = counts || decides;
  const bool fits = of_set || (wants_bool ? asked->type == Type::kBool : IsNumber(asked->type));
  if (!fits) {
    pass_.Error(asked->name_span, "'" + name + "' is of " + (wants_bool ? "bools" : "numbers") +
                                      ", but '" + asked->name + "' is " + NameOf(asked->type));
    return result;
  }
  // One walk over neighbours ends before another begins, so that all share a local.
  call->meaning = Meaning::kOverNeighbours;
  call->role = role;
  // A value has no variables; that it cannot ask neighbours is said where it stands.
  if (!of_set && scope_.routine() != nullptr) {
    call->index = scope_.Hidden("neighbours", call->span, Type::kSet);
  }
  scope_.Uses(vm::Opcode::kTelling, call->operands[0]->span, name);
  return wants_bool ? result : asked->type;
}

Type CallChecker::InferSuper(Expr* member, Expr* call) {
  // Only a member with a body replaces something that runs.
  if (scope_.routine() == nullptr || scope_.routine()->signature < 0) {
    return pass_.Wrong(member->span, "'super' stands only in members that run");
  }
  const Member& own = *scope_.routine()->member;
  if (member->name != own.name) {
    return pass_.Wrong(
        member->name_span,
        "'super' calls what this " + NameOf(scope_.routine()->kind) + " replaces, which is '" +
            own.name + "'",
        "write super." + own.name + "(...); functions of other names are called without it");
  }
  // What the role above has under the name, be it its own or inherited.
  const int parent = model_.roles[scope_.role_index()].parent;
  const int slot =
      parent < 0 ? -1 : FindSlot(*SlotsOf(&model_.roles[parent], scope_.routine()->kind), own.name);
  if (slot < 0) {
    if (model_.roles[scope_.role_index()].broken) return Type::kError;
    return pass_.Wrong(member->span,
                       NameOf(scope_.routine()->kind) + " '" + own.name + "' replaces nothing",
                       "no role that '" + model_.roles[scope_.role_index()].name +
                           "' extends has one of that name");
  }
  // What a member replaces is code, and no value.
  if (call == nullptr) {
    return pass_.Wrong(member->span, "'super." + own.name + "' must be called",
                       "write super." + own.name + "(...)");
  }
  // The callee is known here, however far roles are extended later: super never dispatches.
  const int callee = (*SlotsOf(&model_.roles[parent], scope_.routine()->kind))[slot].routine;
  call->meaning = Meaning::kSuper;
  call->index = callee;
  scope_.routine()->calls.push_back({-1, member->name_span, callee});
  // Whatever replaces a routine takes the same arguments.
  const int signature = model_.routines[callee].signature;
  CheckArguments(call, signature, NameOf(scope_.routine()->kind) + " '" + own.name + "'");
  // A function's result may only be found in a later round, as that of any call.
  const Type result = model_.signatures[signature].result;
  const bool unknown = scope_.routine()->kind == MemberKind::kFunction && result == Type::kVoid;
  return unknown && !pass_.is_final() ? Type::kUnknown : result;
}

Type CallChecker::CommandAsFunction(const std::string& name, const Span& span) {
  return pass_.Wrong(
      span, "'" + name + "' is a command, not a function",
      "a command runs on all that play a role: " + scope_.role().name + "." + name + "(...)");
}

void CallChecker::CheckArguments(Expr* call, int index, const std::string& what) {
  Signature& signature = model_.signatures[index];
  // Wrong numbers of arguments say nothing about types.
  signature.called = true;
  // The first operand is what is called.
  const size_t count = call->operands.size() - 1;
  if (count != signature.parameters.size()) {
    pass_
        .Error(call->span, what + " takes " +
                               Counted(std::ssize(signature.parameters), "argument") + ", not " +
                               std::to_string(count))
        .Note(signature.span, "declared here");
    return;
  }
  for (size_t i = 0; i < count; ++i) {
    // $ANY and sets that stand alone are what a parameter could hold of them.
    Expr* argument = call->operands[i + 1].get();
    Type type = argument->type == Type::kAny ? Type::kDirection : argument->type;
    if (type == Type::kJointSet) type = Type::kJoint;
    if (type == Type::kLinkSet) type = Type::kLink;
    if (pass_.phase() == Phase::kCalls || pass_.phase() == Phase::kDefaults) {
      if (pass_.Settle(&signature.parameters[i], type)) signature.from_call[i] = true;
      // Found as an int in one call, given a float in another: a float.
      if (signature.from_call[i] && signature.parameters[i] == Type::kInt && type == Type::kFloat) {
        pass_.Change(&signature.parameters[i], Type::kFloat);
      }
    }
    // An argument has to fit what is known of the parameter; one of unknown type takes its type.
    conversions_.Want(argument, signature.parameters[i],
                      "argument " + std::to_string(i + 1) + " of " + what);
  }
}

}  // namespace morphbus::dynarole
