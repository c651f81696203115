#include <algorithm>

#include "compiler/base/text.h"
#include "compiler/dynarole/checker.h"
#include "compiler/dynarole/constants.h"

namespace morphbus::dynarole {

using source::Diagnostic;
using source::Span;

namespace {

/// "a, b, c"
std::string Listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

// A member without parentheses has no arguments.
size_t CountArguments(const Expr* call) { return call != nullptr ? call->operands.size() - 1 : 0; }

}  // namespace

Type Checker::InferMember(Expr* expr) {
  if (expr->operands[0]->kind == ExprKind::kSuper) return InferSuper(expr, nullptr);
  return expr->operands[0]->kind == ExprKind::kSelf ? InferSelf(expr, nullptr)
                                                    : InferPart(expr, nullptr);
}

Type Checker::InferCall(Expr* expr) {
  // Arguments have types of their own, whatever is called; operand 0 is what stands before the
  // parenthesis.
  Expr* callee = expr->operands[0].get();
  if (callee->kind == ExprKind::kName && callee->name == "print" &&
      FindSlot(Scope().methods, "print") < 0) {
    return InferPrint(expr);
  }
  for (size_t i = 1; i < expr->operands.size(); ++i) Infer(expr->operands[i].get());
  if (callee->kind == ExprKind::kMember) {
    Expr* base = callee->operands[0].get();
    // A dot before the name: something of self, a command of a role, or something of a joint or
    // connector. Variables and labels hide roles of their name.
    if (base->kind == ExprKind::kSelf) return InferSelf(callee, expr);
    if (base->kind == ExprKind::kSuper) return InferSuper(callee, expr);
    if (base->kind == ExprKind::kName &&
        (routine_ == nullptr || FindLocal(base->name) == nullptr)) {
      const int role = model_.FindRole(base->name);
      if (role >= 0 && FindSlot(Scope().labels, base->name) < 0) {
        return InferInvoke(callee, expr, role);
      }
    }
    return InferPart(callee, expr);
  }
  // No dot: sizeof or a function of the role.
  if (callee->name == "sizeof") return InferSizeof(expr);
  const RoleModel& owner = Scope();
  const int slot = FindSlot(owner.methods, callee->name);
  if (slot >= 0) return InferMethod(expr, callee->name, callee->span, slot);
  if (const std::optional<Type> type = InferFunction(expr)) return *type;
  if (owner.broken) return Type::kError;
  // It is neither. The hint names what may have been meant: something of self, a command, the
  // nearest name, or else all there is.
  if (FindSlot(owner.commands, callee->name) >= 0) {
    return CommandAsFunction(callee->name, callee->span);
  }
  Diagnostic& error = Error(callee->span, "unknown function '" + callee->name + "'");
  if (const std::string usages = UsagesOf(SelfBuiltins(), callee->name); !usages.empty()) {
    error.hint = "did you mean '" + usages + "'?";
    return Type::kError;
  }
  std::vector<std::string> names = {"sizeof", "print"};
  for (const std::string& name : NamesOf(FunctionBuiltins())) names.push_back(name);
  for (const NamedSlot& method : owner.methods) names.push_back(method.name);
  Suggest(&error, callee->name, names);
  if (error.hint.empty()) {
    std::string known;
    for (const std::string& name : names) known += name + ", ";
    Suggest(&error, callee->name, NamesOf(SelfBuiltins()), "self.",
            "functions are " + known + "and behind 'self.': " + Listed(NamesOf(SelfBuiltins())));
  }
  return Type::kError;
}

// Commands run on all modules that play a role, so calling one would not say on which.
Type Checker::CommandAsFunction(const std::string& name, const Span& span) {
  return Wrong(span, "'" + name + "' is a command, not a function",
               "a command runs on all that play a role: " + Scope().name + "." + name + "(...)");
}

Type Checker::InferSizeof(Expr* call) {
  if (call->operands.size() != 2) {
    Error(call->span,
          "'sizeof' takes 1 argument, not " + std::to_string(call->operands.size() - 1));
    return Type::kInt;
  }
  // What is counted: neighbours, joints or links.
  const Expr& set = *call->operands[1];
  if (!IsSet(set.type) && set.type != Type::kError && set.type != Type::kUnknown) {
    Error(set.span, "'sizeof' needs a set, but this is " + NameOf(set.type)).hint =
        "sets are what self.connected, self.joints and self.links yield";
  }
  call->meaning = Meaning::kCount;
  return Type::kInt;
}

Type Checker::InferSelf(Expr* member, Expr* call) {
  // What is built in comes first; no program can replace it.
  for (const Builtin& builtin : SelfBuiltins()) {
    if (member->name == builtin.name) return ApplyBuiltin(SelfBuiltins(), "self.", member, call);
  }
  // A call of a function of the role may have self before it.
  const RoleModel& owner = Scope();
  if (call != nullptr) {
    const int slot = FindSlot(owner.methods, member->name);
    if (slot >= 0) return InferMethod(call, member->name, member->name_span, slot);
    if (FindSlot(owner.commands, member->name) >= 0) {
      return CommandAsFunction(member->name, member->name_span);
    }
  }
  return InferSelfKeyword(member, call);
}

Type Checker::InferSelfKeyword(Expr* member, Expr* call) {
  // A name that two kinds of parts share means the joint before the connector before the link.
  for (const vm::KeywordKind kind :
       {vm::KeywordKind::kJoint, vm::KeywordKind::kConnector, vm::KeywordKind::kLink}) {
    const int keyword = keywords_.Find(kind, member->name);
    if (keyword < 0) continue;
    if (call != nullptr) {
      return Wrong(member->name_span, "'" + member->name + "' names a part and cannot be called");
    }
    return UseKeyword(member, keyword);
  }
  if (keywords_.Find(vm::KeywordKind::kSensor, member->name) >= 0) {
    return Wrong(member->name_span, "sensor " + member->name + " stands for no value",
                 "read it, as in self." + member->name + ".GET_DISTANCE()");
  }
  // Perhaps it is a field, which stands alone, or nearly a name that self has.
  Diagnostic& error = Error(member->name_span, "'self' has no '" + member->name + "'");
  std::vector<std::string> names = NamesOf(SelfBuiltins());
  for (const keywords::Keyword& keyword : keywords_.all()) {
    if (keyword.kind != vm::KeywordKind::kConnectorState &&
        keyword.kind != vm::KeywordKind::kSensorKind) {
      names.push_back(keyword.spelling);
    }
  }
  const RoleModel& owner = Scope();
  if (model_.FindField(owner, member->name) >= 0) {
    error.hint = "fields are written without 'self.'";
    return Type::kError;
  }
  if (const std::string usages = UsagesOf(FunctionBuiltins(), member->name); !usages.empty()) {
    error.hint = "did you mean '" + usages + "'?";
    return Type::kError;
  }
  // Names of modules would bind a program to one assembly.
  if (member->name == "id" || member->name == "name" || member->name == "number") {
    error.hint =
        "programs name no module: write a role for it, with labels and requirements that only it "
        "meets";
    return Type::kError;
  }
  // The list is long, so that it is printed once.
  const std::string list =
      listed_self_
          ? "what it has is listed above"
          : "it has " + Listed(names) + (keywords_.empty() ? "; no module types were given" : "");
  Suggest(&error, member->name, names, "self.", list);
  listed_self_ = listed_self_ || error.hint == list;
  return Type::kError;
}

// Behind the dot of a joint or connector: self.JOINT_1.SET_POSITION(90),
// self.C1.SET_EXTENDED(true).
Type Checker::InferPart(Expr* member, Expr* call) {
  Expr* base = member->operands[0].get();
  // A sensor is no value, so that its name is looked at before it is one.
  if (base->kind == ExprKind::kMember && base->operands[0]->kind == ExprKind::kSelf) {
    const int sensor = keywords_.Find(vm::KeywordKind::kSensor, base->name);
    if (sensor >= 0 && keywords_.Find(vm::KeywordKind::kJoint, base->name) < 0 &&
        keywords_.Find(vm::KeywordKind::kConnector, base->name) < 0) {
      return InferSensor(member, call, sensor);
    }
  }
  const Type type = Infer(base);
  if (type == Type::kError || type == Type::kUnknown) return Type::kError;
  if (type == Type::kConnector) return InferConnectorState(member, call);
  if (type == Type::kSet) return InferNeighbours(member, call);
  if (type == Type::kJoint || type == Type::kJointSet) {
    Want(base, Type::kJoint, "what stands before the dot");
    return ApplyBuiltin(JointBuiltins(), "JOINT.", member, call);
  }
  return Wrong(member->name_span, NameOf(type) + " has no '" + member->name + "'",
               "only self, roles, neighbours, joints and connectors have members");
}

Type Checker::InferConnectorState(Expr* member, Expr* call) {
  // Whether something is docked is no variable, and every connector knows it.
  if (member->name == "CONNECTED" && call == nullptr) {
    return ApplyBuiltin(ConnectorBuiltins(), "CONNECTOR.", member, call);
  }
  // The names of state variables stand behind SET_ and GET_.
  std::vector<std::string> names = {"CONNECTED"};
  for (const std::string& state : keywords_.Spellings(vm::KeywordKind::kConnectorState)) {
    names.push_back("SET_" + state);
    names.push_back("GET_" + state);
  }
  const std::string verb = member->name.substr(0, 4);
  const bool sets = verb == "SET_";
  const std::string state = sets || verb == "GET_" ? member->name.substr(4) : "";
  const int keyword = keywords_.Find(vm::KeywordKind::kConnectorState, state);
  if (state.empty() || keyword < 0) {
    Suggest(&Error(member->name_span, "a connector has no '" + member->name + "'"), member->name,
            names, "",
            "state variables of connectors are set with SET_ and read with GET_ and their name; "
            "CONNECTED tells whether something is docked");
    return Type::kError;
  }
  const keywords::Keyword& entry = keywords_.all()[keyword];
  if (call == nullptr || call->operands.size() != (sets ? 2 : 1)) {
    return Wrong(member->name_span,
                 "'" + member->name + "' takes " + (sets ? "1 argument" : "no arguments"),
                 "for example self.C1." + member->name + (sets ? "(true)" : "()"));
  }
  // A state may be a bool in one module type and have numbered values in another; the argument says
  // which is meant. What is read is a bool where it can be one.
  const bool is_int = sets && call->operands[1]->type == Type::kInt;
  const bool is_bool = entry.takes_bool && !(entry.takes_int && is_int);
  if (sets) {
    Want(call->operands[1].get(), is_bool ? Type::kBool : Type::kInt,
         "the argument of '" + member->name + "'");
  }
  UseKeyword(member, keyword);
  call->meaning = Meaning::kBuiltin;
  call->opcode = sets ? (is_bool ? vm::Opcode::kSetStateBool : vm::Opcode::kSetStateInt)
                      : (is_bool ? vm::Opcode::kGetStateBool : vm::Opcode::kGetStateInt);
  call->index = member->index;
  Uses(call->opcode, member->name_span, member->name);
  if (sets) return Type::kVoid;
  return is_bool ? Type::kBool : Type::kInt;
}

Type Checker::ApplyBuiltin(const std::vector<Builtin>& table, const std::string& prefix,
                           Expr* member, Expr* call) {
  // A property stands without parentheses, so that the member itself is the expression.
  Expr* expr = call != nullptr ? call : member;
  const Builtin* form = nullptr;
  for (const Builtin& builtin : table) {
    if (member->name != builtin.name) continue;
    if (std::string(builtin.arguments).size() == CountArguments(call) &&
        (call != nullptr || builtin.property)) {
      form = &builtin;
    }
  }
  const std::string usages = UsagesOf(table, member->name);
  if (usages.empty()) {
    Suggest(&Error(member->name_span, "a joint has no '" + member->name + "'"), member->name,
            NamesOf(table), "", "joints have AXIS, SET_POSITION(degrees) and GET_POSITION()");
    return Type::kError;
  }
  // The name is right but no form of it takes so many arguments.
  if (form == nullptr) {
    return Wrong(expr->span,
                 call == nullptr ? "'" + prefix + member->name + "' must be called"
                                 : "'" + prefix + member->name + "' does not take " +
                                       Counted(std::ssize(call->operands) - 1, "argument"),
                 "write " + usages);
  }
  // The letters of the form are the types of its arguments.
  for (size_t i = 0; i < CountArguments(call); ++i) {
    Want(call->operands[i + 1].get(), TypeOfLetter(form->arguments[i]),
         "argument " + std::to_string(i + 1) + " of '" + prefix + member->name + "'");
  }
  expr->meaning = Meaning::kBuiltin;
  expr->opcode = form->opcode;
  if (form->motion != Motion::kAny) CheckMotion(*form, *call->operands[1]);
  if (form->opcode == vm::Opcode::kJoints || form->opcode == vm::Opcode::kLinks) {
    CheckCount(*form, *call->operands.back());
  }
  Uses(form->opcode, member->name_span, prefix + member->name);
  if (vm::InfoOf(form->opcode).operand == vm::OperandKind::kSensorKindKeyword) {
    return UseSensorKind(expr, member->name_span);
  }
  return TypePushedBy(form->opcode);
}

// A joint that turns in no module type cannot turn, and one that slides in none cannot slide; at
// run time that would be a fault in every module.
void Checker::CheckMotion(const Builtin& builtin, const Expr& joint) {
  const Motions motions = MotionsOf(joint);
  if (motions.turns == motions.slides) return;  // Either may be, or nothing is known.
  if (motions.turns == (builtin.motion == Motion::kTurns)) return;
  Error(joint.span,
        std::string("'self.") + builtin.name + "' needs a joint that " +
            (motions.turns ? "slides, but this joint turns" : "turns, but this joint slides"))
      .hint = motions.turns ? "write " + UsagesOf(SelfBuiltins(), "jointRotateDegrees")
                            : "write " + UsagesOf(SelfBuiltins(), "jointMoveMillimetres");
}

// What the joint can do in some module type: one named by a keyword, or any that a label may stand
// for in a role that inherits this code; of other expressions any joint there is.
Checker::Motions Checker::MotionsOf(const Expr& joint) const {
  Motions motions;
  const auto add = [&motions](const auto& other) {
    motions.turns |= other.turns;
    motions.slides |= other.slides;
  };
  if (joint.meaning == Meaning::kKeyword) {
    add(keywords_.all()[model_.keywords[joint.index]]);
  } else if (joint.meaning == Meaning::kLabel) {
    for (int role = 0; role < std::ssize(model_.roles); ++role) {
      if (!model_.IsA(role, role_)) continue;
      const Routine& label = model_.routines[model_.roles[role].labels[joint.index].routine];
      add(MotionsOf(*label.member->expr));
    }
  } else {
    for (const keywords::Keyword& keyword : keywords_.all()) add(keyword);
  }
  return motions;
}

// Numbers of adjacent joints and degrees that no robot can have.
void Checker::CheckCount(const Builtin& builtin, const Expr& count) {
  // Only a number that stands in the text can be judged now.
  const FoldResult folded = Fold(count);
  if (!folded.value || folded.value->type != Type::kInt) return;
  const int value = folded.value->cell.AsInt();
  const bool joints = builtin.opcode == vm::Opcode::kJoints;
  // Two bodies meet at a joint, and each holds so many joints at most.
  const int most = joints ? 2 * (vm::kMaxBodyJoints - 1) : vm::kMaxBodyJoints;
  if (value >= 0 && value <= most) return;
  Error(count.span, (joints ? "no joint has " : "no link has ") + std::to_string(value) +
                        (joints ? " adjacent joints" : " joints on its body") +
                        ", so this matches nothing")
      .hint = "write a number from 0 to " + std::to_string(most);
}

// Instructions that act cannot stand in requirements and labels, which are evaluated at any time.
void Checker::Uses(vm::Opcode opcode, const Span& span, const std::string& name) {
  // A field's value has no routine, and is refused elsewhere.
  const vm::Effect effect = vm::InfoOf(opcode).effect;
  if (routine_ == nullptr) return;
  routine_->effect = std::max(routine_->effect, effect);
  if (effect != vm::Effect::kPure && !InTask()) {
    Error(span,
          "'" + name + "' acts on the module, which a " + NameOf(routine_->kind) + " must not")
        .hint = "requirements and labels only ask about the robot's structure";
  }
}

Type Checker::InferMethod(Expr* call, const std::string& name, const Span& span, int slot) {
  if (routine_ == nullptr) return Wrong(span, "value of a field must be known at compile time");
  // The result type is that of the signature, which all functions in the slot share; it is unknown
  // until a return with a value has been found.
  const RoleModel& owner = Scope();
  const Routine& callee = model_.routines[owner.methods[slot].routine];
  model_.signatures[callee.signature].called = true;
  call->meaning = Meaning::kMethod;
  call->index = slot;
  routine_->calls.push_back({slot, span});
  CheckArguments(call, callee.signature, "function '" + name + "'");
  const Type result = model_.signatures[callee.signature].result;
  return result == Type::kVoid && phase_ != Phase::kFinal ? Type::kUnknown : result;
}

Type Checker::InferInvoke(Expr* member, Expr* call, int role, Meaning meaning) {
  // The command is looked up in the role that is named, not in the one that invokes it.
  const RoleModel& target = model_.roles[role];
  const int slot = FindSlot(target.commands, member->name);
  if (slot < 0) {
    if (target.broken) return Type::kError;
    Diagnostic& error = Error(member->name_span,
                              "role '" + target.name + "' has no command '" + member->name + "'");
    // A slip, a command of another role, or a member that is no command.
    std::vector<std::string> names;
    for (const NamedSlot& command : target.commands) names.push_back(command.name);
    Suggest(&error, member->name, names);
    for (const RoleModel& other : model_.roles) {
      if (error.hint.empty() && FindSlot(other.commands, member->name) >= 0) {
        error.hint = "role '" + other.name + "' has one";
      }
    }
    for (const std::vector<NamedSlot>* table :
         {&target.methods, &target.startups, &target.behaviors, &target.handlers}) {
      if (FindSlot(*table, member->name) >= 0) {
        error.hint = "only what is declared with 'command' can be run from elsewhere";
      }
    }
    return Type::kError;
  }
  const int signature = model_.routines[target.commands[slot].routine].signature;
  call->meaning = meaning;
  call->role = role;
  call->index = slot;
  CheckArguments(call, signature, "command '" + target.name + "." + member->name + "'");
  Uses(vm::Opcode::kInvoke, member->name_span, target.name + "." + member->name);
  return Type::kVoid;
}

void Checker::CheckArguments(Expr* call, int index, const std::string& what) {
  Signature& signature = model_.signatures[index];
  // Wrong numbers of arguments say nothing about types.
  signature.called = true;
  const size_t count = call->operands.size() - 1;
  if (count != signature.parameters.size()) {
    Error(call->span, what + " takes " + Counted(std::ssize(signature.parameters), "argument") +
                          ", not " + std::to_string(count))
        .Note(signature.span, "declared here");
    return;
  }
  for (size_t i = 0; i < count; ++i) {
    // $ANY and sets that stand alone are what a parameter could hold of them.
    Expr* argument = call->operands[i + 1].get();
    Type type = argument->type == Type::kAny ? Type::kDirection : argument->type;
    if (type == Type::kJointSet) type = Type::kJoint;
    if (type == Type::kLinkSet) type = Type::kLink;
    if (phase_ == Phase::kCalls || phase_ == Phase::kDefaults) {
      if (Settle(&signature.parameters[i], type)) signature.from_call[i] = true;
      // Found as an int in one call, given a float in another: a float.
      if (signature.from_call[i] && signature.parameters[i] == Type::kInt && type == Type::kFloat) {
        Change(&signature.parameters[i], Type::kFloat);
      }
    }
    Want(argument, signature.parameters[i], "argument " + std::to_string(i + 1) + " of " + what);
  }
}

}  // namespace morphbus::dynarole
