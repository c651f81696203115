#include "compiler/dynarole/part_checker.h"

#include <algorithm>

#include "compiler/dynarole/builtins.h"
#include "vm/image/image_texts.h"

namespace morphbus::dynarole {

using source::Diagnostic;
using source::Span;

namespace {

/// What an instruction reads.
vm::SensorKind KindOf(vm::Opcode opcode) {
  if (opcode == vm::Opcode::kDistance) return vm::SensorKind::kDistance;
  return opcode == vm::Opcode::kContact ? vm::SensorKind::kContact : vm::SensorKind::kTilt;
}

}  // namespace

Type PartChecker::UseKeyword(Expr* expr, int keyword) {
  const keywords::Keyword& entry = keywords_.all()[keyword];
  // The image lists each keyword once, in the order of their first use.
  auto& used = model_.keywords;
  auto it = std::find(used.begin(), used.end(), keyword);
  if (it == used.end()) {
    if (used.size() == vm::kMaxKeywords) {
      return pass_.Wrong(expr->name_span, "too many keywords in one program",
                         "at most " + std::to_string(vm::kMaxKeywords));
    }
    it = used.insert(used.end(), keyword);
  }
  // The number in the program is not that in the table: the image lists only what it uses.
  expr->meaning = Meaning::kKeyword;
  expr->index = static_cast<int>(it - used.begin());
  switch (entry.kind) {
    case vm::KeywordKind::kLink:
      return Type::kLink;
    case vm::KeywordKind::kJoint:
      return Type::kJoint;
    default:
      return Type::kConnector;
  }
}

Type PartChecker::UseSensorKind(Expr* expr, const source::Span& span) {
  const std::string kind = ToString(vm::kSensorKindNames[static_cast<int>(KindOf(expr->opcode))]);
  const int keyword = keywords_.Find(vm::KeywordKind::kSensorKind, kind);
  if (keyword < 0) {
    // No module could ever take the role.
    static constexpr const char* kWords[] = {"distance", "contact", "tilt"};
    const std::string word = kWords[static_cast<int>(KindOf(expr->opcode))];
    return pass_.Wrong(span, "no module type that was given has a " + word + " sensor",
                       keywords_.empty()
                           ? "no module types were given"
                           : "declare one in M3L: sensor NAME: type=" + word + ", ...");
  }
  // UseKeyword makes the expression mean the part; here it is an operand of the call.
  const Meaning meaning = expr->meaning;
  const Type used = UseKeyword(expr, keyword);
  expr->meaning = meaning;
  return used == Type::kError ? Type::kError : TypePushedBy(expr->opcode);
}

Type PartChecker::InferOfSelf(Expr* member, Expr* call) {
  // A name that two kinds of parts share means the joint before the connector before the link.
  for (const vm::KeywordKind kind :
       {vm::KeywordKind::kJoint, vm::KeywordKind::kConnector, vm::KeywordKind::kLink}) {
    const int keyword = keywords_.Find(kind, member->name);
    if (keyword < 0) continue;
    // A part is a value and has nothing to be called with.
    if (call != nullptr) {
      return pass_.Wrong(member->name_span,
                         "'" + member->name + "' names a part and cannot be called");
    }
    return UseKeyword(member, keyword);
  }
  // A sensor alone says nothing: it is what it measures that has a value.
  if (keywords_.Find(vm::KeywordKind::kSensor, member->name) >= 0) {
    return pass_.Wrong(member->name_span, "sensor " + member->name + " stands for no value",
                       "read it, as in self." + member->name + ".GET_DISTANCE()");
  }
  // Perhaps it is a field, which stands alone, or nearly a name that self has.
  Diagnostic& error = pass_.Error(member->name_span, "'self' has no '" + member->name + "'");
  // Both what is built in and what the module types have may have been meant.
  std::vector<std::string> names = NamesOf(SelfBuiltins());
  for (const keywords::Keyword& keyword : keywords_.all()) {
    if (keyword.kind != vm::KeywordKind::kConnectorState &&
        keyword.kind != vm::KeywordKind::kSensorKind) {
      names.push_back(keyword.spelling);
    }
  }
  const RoleModel& owner = scope_.role();
  if (model_.FindField(owner, member->name) >= 0) {
    error.hint = "fields are written without 'self.'";
    return Type::kError;
  }
  // Functions of the language stand without self.
  if (const std::string usages = UsagesOf(FunctionBuiltins(), member->name); !usages.empty()) {
    error.hint = "did you mean '" + usages + "'?";
    return Type::kError;
  }
  // Names of modules would bind a program to one assembly.
  if (member->name == "name" || member->name == "number") {
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
  const std::string usages = UsagesBeginning(SelfBuiltins(), member->name);
  pass_.Suggest(&error, member->name, names, "self.",
                usages.empty() ? list : "did you mean '" + usages + "'?");
  listed_self_ = listed_self_ || error.hint == list;
  return Type::kError;
}

int PartChecker::FindSensor(const Expr& base) const {
  if (base.kind != ExprKind::kMember || base.operands[0]->kind != ExprKind::kSelf) return -1;
  // Names of joints and connectors go before those of sensors.
  const bool part = keywords_.Find(vm::KeywordKind::kJoint, base.name) >= 0 ||
                    keywords_.Find(vm::KeywordKind::kConnector, base.name) >= 0;
  return part ? -1 : keywords_.Find(vm::KeywordKind::kSensor, base.name);
}

Type PartChecker::InferSensor(Expr* member, Expr* call, int keyword) {
  const keywords::Keyword& entry = keywords_.all()[keyword];
  // What it measures in some module type is what it may be asked; the other forms are not offered.
  std::string usages;
  const Builtin* form = nullptr;
  for (size_t kind = 0; kind < SensorBuiltins().size(); ++kind) {
    const Builtin& builtin = SensorBuiltins()[kind];
    if ((entry.measures >> kind & 1) == 0) continue;
    usages += (usages.empty() ? "self." : " or self.") + entry.spelling + "." + builtin.name + "()";
    if (member->name == builtin.name) form = &builtin;
  }
  if (form == nullptr || call == nullptr || call->operands.size() != 1) {
    return pass_.Wrong(member->name_span,
                       "sensor " + entry.spelling + " is not read by '" + member->name + "'",
                       "write " + usages);
  }
  if (UseKeyword(member, keyword) == Type::kError) return Type::kError;
  // The keyword is the instruction's operand; nothing of what stands before the dot is pushed.
  call->meaning = Meaning::kBuiltin;
  call->opcode = form->opcode;
  call->index = member->index;
  member->operands[0]->meaning = Meaning::kNone;
  // To read is to act on nothing, but takes a sensor: the role needs it.
  scope_.Uses(form->opcode, member->name_span, member->name);
  return TypePushedBy(form->opcode);
}

Type PartChecker::InferConnectorState(Expr* member, Expr* call) {
  // The names of state variables stand behind SET_ and GET_.
  std::vector<std::string> names = {"CONNECTED"};
  for (const std::string& state : keywords_.Spellings(vm::KeywordKind::kConnectorState)) {
    names.push_back("SET_" + state);
    names.push_back("GET_" + state);
  }
  // The four letters before the name of a state say what is done with it.
  const std::string verb = member->name.substr(0, 4);
  const bool sets = verb == "SET_";
  const std::string state = sets || verb == "GET_" ? member->name.substr(4) : "";
  const int keyword = keywords_.Find(vm::KeywordKind::kConnectorState, state);
  if (state.empty() || keyword < 0) {
    pass_.Suggest(
        &pass_.Error(member->name_span, "a connector has no '" + member->name + "'"), member->name,
        names, "",
        "state variables of connectors are set with SET_ and read with GET_ and their name; "
        "CONNECTED tells whether something is docked");
    return Type::kError;
  }
  // To set takes the value, to get takes nothing.
  const keywords::Keyword& entry = keywords_.all()[keyword];
  if (call == nullptr || call->operands.size() != (sets ? 2 : 1)) {
    return pass_.Wrong(member->name_span,
                       "'" + member->name + "' takes " + (sets ? "1 argument" : "no arguments"),
                       "for example self.C1." + member->name + (sets ? "(true)" : "()"));
  }
  // A state may be a bool in one module type and have numbered values in another; the argument says
  // which is meant. What is read is a bool where it can be one.
  const bool is_int = sets && call->operands[1]->type == Type::kInt;
  const bool is_bool = entry.takes_bool && !(entry.takes_int && is_int);
  if (sets) {
    conversions_.Want(call->operands[1].get(), is_bool ? Type::kBool : Type::kInt,
                      "the argument of '" + member->name + "'");
  }
  // The state becomes the operand of the instruction, and a module without it cannot take the role.
  UseKeyword(member, keyword);
  call->meaning = Meaning::kBuiltin;
  call->opcode = sets ? (is_bool ? vm::Opcode::kSetStateBool : vm::Opcode::kSetStateInt)
                      : (is_bool ? vm::Opcode::kGetStateBool : vm::Opcode::kGetStateInt);
  call->index = member->index;
  scope_.Uses(call->opcode, member->name_span, member->name);
  if (sets) return Type::kVoid;
  return is_bool ? Type::kBool : Type::kInt;
}

}  // namespace morphbus::dynarole
