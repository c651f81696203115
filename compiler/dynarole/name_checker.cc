#include "compiler/dynarole/name_checker.h"

#include <utility>

#include "compiler/dynarole/builtins.h"

namespace morphbus::dynarole {

using source::Diagnostic;

Type NameChecker::InferName(Expr* expr) {
  // Variables and parameters hide fields, and fields hide labels.
  if (Local* local = scope_.routine() != nullptr ? scope_.FindLocal(expr->name) : nullptr) {
    local->used = true;
    expr->meaning = Meaning::kLocal;
    expr->index = local->slot;
    return scope_.routine()->locals[local->slot];
  }
  const RoleModel& owner = scope_.role();
  if (const int slot = model_.FindField(owner, expr->name); slot >= 0) {
    expr->meaning = Meaning::kField;
    expr->index = slot;
    FieldDecl& decl = model_.fields[owner.fields[slot].decl];
    // Values of other fields do not count as readers: a field that only they use is of no use
    // itself.
    if (scope_.routine() != nullptr) decl.read = true;
    return decl.type;
  }
  const int label = FindSlot(owner.labels, expr->name);
  if (label >= 0) {
    // A field's value cannot name a label; the caller says what it can be.
    if (scope_.routine() == nullptr) return Type::kVoid;
    if (!scope_.InTask()) {
      return pass_.Wrong(expr->span, "a " + NameOf(scope_.routine()->kind) + " cannot use labels",
                         "labels are resolved after all requirements hold");
    }
    expr->meaning = Meaning::kLabel;
    expr->index = label;
    const Routine& routine = model_.routines[owner.labels[label].routine];
    // Labels are checked in their turn, and this one may come later in the pass.
    return routine.result == Type::kVoid ? Type::kUnknown : routine.result;
  }
  // Constants of the role cannot share a name with the above; those outside all stand behind them.
  const int constant = model_.FindConstant(scope_.role_index(), expr->name);
  if (constant < 0 && model_.FindEnumeration(expr->name) >= 0) {
    return pass_.Wrong(expr->span, "'" + expr->name + "' is an enumeration, and no value",
                       "write the name of one of its values");
  }
  if (constant >= 0) return constants_.Infer(expr, constant);
  if (expr->name != kPiName) return UnknownName(*expr);
  // The one name that every program knows.
  expr->meaning = Meaning::kConstant;
  expr->index = -1;
  expr->cell = vm::Cell::Float(kPi);
  return Type::kFloat;
}

bool NameChecker::IsEnumeration(const std::string& name) const {
  const RoleModel& owner = scope_.role();
  const bool hidden = (scope_.routine() != nullptr && scope_.FindLocal(name) != nullptr) ||
                      model_.FindField(owner, name) >= 0 || FindSlot(owner.labels, name) >= 0;
  return !hidden && model_.FindEnumeration(name) >= 0;
}

int NameChecker::ValueOfEnumeration(const std::string& enumeration,
                                    const std::string& value) const {
  if (!IsEnumeration(enumeration)) return -1;
  // By its full name a value is found whatever hides its own, and wherever it is declared.
  const int number = model_.FindEnumeration(enumeration);
  for (int i = 0; i < std::ssize(model_.constants); ++i) {
    const ConstantModel& constant = model_.constants[i];
    if (constant.enumeration == number && constant.name == value) return i;
  }
  return -1;
}

Type NameChecker::UnknownValue(const Expr& member) {
  const std::string& enumeration = member.operands[0]->name;
  std::vector<std::string> names;
  for (const ConstantModel& constant : model_.constants) {
    if (constant.enumeration == model_.FindEnumeration(enumeration)) names.push_back(constant.name);
  }
  pass_.Suggest(
      &pass_.Error(member.name_span, "'" + enumeration + "' has no value '" + member.name + "'"),
      member.name, names);
  return Type::kError;
}

Type NameChecker::UnknownName(const Expr& expr) {
  // A role whose base is not known may inherit the name.
  const RoleModel& owner = scope_.role();
  if (owner.broken) return Type::kError;
  Diagnostic& error = pass_.Error(expr.span, "unknown name '" + expr.name + "'");
  // A direction without its sign, or something of self.
  if (FindDirection(expr.name) != nullptr) {
    error.hint = "did you mean '$" + expr.name + "'?";
    return Type::kError;
  }
  if (const std::string usages = UsagesOf(SelfBuiltins(), expr.name); !usages.empty()) {
    error.hint = "did you mean '" + usages + "'?";
    return Type::kError;
  }
  // Parts of the module type have their keywords behind a sign of their own.
  for (const auto& [kind, sign] :
       {std::pair(vm::KeywordKind::kJoint, "self."),
        std::pair(vm::KeywordKind::kConnector, "self."),
        std::pair(vm::KeywordKind::kSensor, "self."), std::pair(vm::KeywordKind::kLink, "$")}) {
    if (keywords_.Find(kind, expr.name) < 0) continue;
    error.hint = "did you mean '" + std::string(sign) + expr.name + "'?";
    return Type::kError;
  }
  // Functions and roles are known, but are no values.
  if (FindSlot(owner.methods, expr.name) >= 0) {
    error.message = "function '" + expr.name + "' is not called";
    error.hint = "write " + expr.name + "(...)";
    return Type::kError;
  }
  if (model_.FindRole(expr.name) >= 0) {
    error.message = "role '" + expr.name + "' cannot stand here";
    error.hint =
        "as a value write '$" + expr.name + "'; to run a command write " + expr.name + ".command()";
    return Type::kError;
  }
  // Code of a base role often means a field that only its subroles declare.
  for (int r = 0; r < std::ssize(model_.roles); ++r) {
    const RoleModel& role = model_.roles[r];
    const int slot = model_.IsA(r, scope_.role_index()) ? model_.FindField(role, expr.name) : -1;
    if (slot < 0) continue;
    // One that all concrete subroles had would be known here.
    const RoleModel* without = nullptr;
    model_.FieldOfSubroles(scope_.role_index(), expr.name, &without);
    error.hint = "its subrole '" + role.name + "' has this field, but " +
                 (without != nullptr ? "'" + without->name + "' has not; give it one"
                                     : "'" + owner.name + "' itself can be taken") +
                 ", or declare it here: " + expr.name + ";";
    error.notes.push_back({model_.fields[role.fields[slot].decl].span, "declared here"});
    return Type::kError;
  }
  // Last, a slip in any name that may stand here.
  std::vector<std::string> names = scope_.Names();
  for (const NamedSlot& slot : owner.labels) names.push_back(slot.name);
  // A role stands before the name of its command.
  for (const RoleModel& role : model_.roles) {
    if (role.name != "Module") names.push_back(role.name);
  }
  pass_.Suggest(&error, expr.name, names, "",
                names.empty() ? "" : "names that are known here are " + Listed(names));
  return Type::kError;
}

Type NameChecker::InferDollar(Expr* expr) {
  // Directions come first, so that no role or part can take their names.
  expr->meaning = Meaning::kConstant;
  if (const NamedDirection* constant = FindDirection(expr->name)) {
    expr->cell = vm::Cell::Int(constant->value);
    return constant->type;
  }
  // A role of the program, then a part of the module.
  const int role = expr->name == "Module" ? -1 : model_.FindRole(expr->name);
  if (role >= 0) {
    expr->cell = vm::Cell::Int(role);
    return Type::kRole;
  }
  // A part of the module is not known before a module binds its keyword.
  expr->meaning = Meaning::kNone;
  for (const vm::KeywordKind kind :
       {vm::KeywordKind::kLink, vm::KeywordKind::kJoint, vm::KeywordKind::kConnector}) {
    const int keyword = keywords_.Find(kind, expr->name);
    if (keyword >= 0) return parts_.UseKeyword(expr, keyword);
  }
  return UnknownDollar(*expr);
}

Type NameChecker::UnknownDollar(const Expr& expr) {
  Diagnostic& error = pass_.Error(expr.span, "unknown name '$" + expr.name + "'");
  // All modules play Module, so that nothing can ask for it.
  if (expr.name == "Module") {
    error.message = "'$Module' is no value";
    error.hint = "every module plays Module; leave it out";
    return Type::kError;
  }
  // A slip: the nearest of all that may stand behind the sign.
  std::vector<std::string> names;
  for (const NamedDirection& constant : kDirections) names.emplace_back(constant.name);
  for (const RoleModel& other : model_.roles) names.push_back(other.name);
  for (const keywords::Keyword& keyword : keywords_.all()) {
    if (keyword.kind == vm::KeywordKind::kLink) names.push_back(keyword.spelling);
  }
  std::string otherwise = "it is no direction, axis or role, nor a link of a module type given";
  if (keywords_.empty()) otherwise = "no module types were given";
  pass_.Suggest(&error, expr.name, names, "$", otherwise);
  return Type::kError;
}

}  // namespace morphbus::dynarole
