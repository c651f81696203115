#include "compiler/dynarole/name_index.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "compiler/dynarole/builtins.h"

namespace morphbus::dynarole {
namespace {

using source::NameKind;
using source::NameTable;
using source::Span;

/// The kind of name that a member has; a requirement has none.
NameKind KindOf(MemberKind kind) {
  switch (kind) {
    case MemberKind::kLabel:
      return NameKind::kLabel;
    case MemberKind::kStartup:
      return NameKind::kStartup;
    case MemberKind::kBehavior:
      return NameKind::kBehavior;
    case MemberKind::kCommand:
      return NameKind::kCommand;
    case MemberKind::kHandler:
      return NameKind::kHandler;
    case MemberKind::kFunction:
      return NameKind::kFunction;
    case MemberKind::kField:
    case MemberKind::kRequire:
      break;
  }
  return NameKind::kField;
}

/// Walks over a checked program: first all roles and members are declared, then the names in their
/// code are looked up by the meanings that the checker gave them.
class Indexer {
 public:
  Indexer(const source::SourceSet& sources, const keywords::KeywordTable& keywords,
          const ProgramModel& model)
      : sources_(sources), keywords_(keywords), model_(model) {}

  NameTable Index() {
    DeclareRoles();
    DeclareConstants();
    for (int r = 0; r < std::ssize(model_.roles); ++r) DeclareFieldsAndLabels(r);
    for (int r = 0; r < std::ssize(model_.roles); ++r) UseInTraces(r);
    for (const Routine& routine : model_.routines) DeclareMember(routine);
    // Values first, then all that runs.
    for (const ConstantModel& constant : model_.constants) {
      role_ = constant.role;
      for (const Expr* expr : {constant.expr, constant.least, constant.most}) Use(expr);
    }
    for (int r = 0; r < std::ssize(model_.roles); ++r) {
      role_ = r;
      for (const Member& member : model_.roles[r].role->members) {
        if (member.kind == MemberKind::kField) Use(member.expr.get());
        Use(member.period.get());
      }
    }
    for (int i = 0; i < std::ssize(model_.routines); ++i) UseInRoutine(i);
    table_.Sort();
    return std::move(table_);
  }

 private:
  [[nodiscard]] std::string TextOf(const Expr& expr) const {
    // A value may stand on several lines; a summary has one.
    std::string text(sources_.text(expr.span));
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
    return text;
  }

  void DeclareRoles() {
    const int root = table_.Add(NameKind::kRole, "Module");
    table_.things[root].summary = "the root of all roles: every module plays it";
    for (const RoleModel& role : model_.roles) {
      // The root of all roles has no text of its own.
      if (role.role == model_.program->root.get()) {
        roles_.push_back(root);
        continue;
      }
      const int thing = table_.Declare(NameKind::kRole, role.name, role.role->name_span);
      roles_.push_back(thing);
      source::NamedThing& entry = table_.things[thing];
      entry.extent = role.role->span;
      for (const Member& member : role.role->members) {
        entry.extent.end = std::max(entry.extent.end, member.span.end);
        const bool requires_it = member.kind == MemberKind::kRequire && member.expr != nullptr;
        if (requires_it) entry.requirements.push_back(TextOf(*member.expr));
      }
      entry.summary = (role.role->abstract_role ? "abstract role " : "role ") + role.name +
                      " extends " + role.role->base;
    }
    for (size_t r = 0; r < model_.roles.size(); ++r) {
      if (roles_[r] == root) continue;
      const int parent = model_.roles[r].parent;
      // A role whose base is not known extends nothing that has a place.
      const bool known = parent >= 0 || model_.roles[r].role->base == "Module";
      const int base = !known ? -1 : parent < 0 ? root : roles_[parent];
      table_.things[roles_[r]].base = base;
      table_.Use(model_.roles[r].role->base_span, base);
    }
  }

  [[nodiscard]] int RoleThing(int role) const { return role < 0 ? -1 : roles_[role]; }

  void DeclareConstants() {
    for (const Enumeration& enumeration : model_.program->enumerations) {
      enumerations_.push_back(
          table_.Declare(NameKind::kEnumeration, enumeration.name, enumeration.name_span));
      table_.things[enumerations_.back()].summary = "enum " + enumeration.name;
    }
    for (const ConstantModel& constant : model_.constants) {
      const int thing =
          table_.Declare(constant.is_parameter() ? NameKind::kParameter : NameKind::kConstant,
                         constant.name, constant.span, RoleThing(constant.role));
      constants_.push_back(thing);
      std::string summary = constant.Kind() + " " + Typed(constant.name, constant.type);
      if (constant.enumeration >= 0) {
        summary = model_.program->enumerations[constant.enumeration].name + "." + constant.name +
                  " = " + std::to_string(constant.cell.AsInt());
      } else if (constant.expr != nullptr) {
        summary += " = " + TextOf(*constant.expr);
      }
      if (constant.is_parameter() && constant.most != nullptr) {
        summary += " in [" + TextOf(*constant.least) + ", " + TextOf(*constant.most) + "]";
      }
      table_.things[thing].summary = summary;
    }
  }

  /// "speed: float", or the name alone.
  static std::string Typed(const std::string& name, Type type) {
    const std::string word = WordOf(type);
    return word.empty() ? name : name + ": " + word;
  }

  /// The highest role above `role`, or itself, that has a label of this name.
  [[nodiscard]] int OwnerOfLabel(int role, const std::string& name) const {
    while (model_.roles[role].parent >= 0 &&
           FindSlot(model_.roles[model_.roles[role].parent].labels, name) >= 0) {
      role = model_.roles[role].parent;
    }
    return role;
  }

  /// Fields that are traced are used there.
  void UseInTraces(int r) {
    const RoleModel& role = model_.roles[r];
    for (const Trace& trace : role.role->traces) {
      const int slot = model_.FindField(role, trace.name);
      if (slot >= 0) table_.Use(trace.name_span, fields_[role.fields[slot].decl]);
    }
  }

  void DeclareFieldsAndLabels(int r) {
    const RoleModel& role = model_.roles[r];
    fields_.resize(model_.fields.size(), -1);
    for (const Member& member : role.role->members) {
      if (member.kind == MemberKind::kField) {
        const int slot = model_.FindField(role, member.name);
        if (slot < 0) continue;
        const int decl = role.fields[slot].decl;
        int& thing = fields_[decl];
        // The elements of an array are one thing.
        if (member.element > 0) {
          thing = fields_[role.fields[slot - member.element].decl];
          continue;
        }
        // A field that a subrole sets anew is the same field.
        if (thing >= 0) {
          table_.Use(member.name_span, thing, true);
          continue;
        }
        thing =
            table_.Declare(NameKind::kField, member.declared_name(), member.name_span, roles_[r]);
        source::NamedThing& entry = table_.things[thing];
        entry.extent = member.span;
        entry.summary = std::string(member.shared ? "shared " : "") + (member.kept ? "kept " : "") +
                        "field " + Typed(member.declared_name(), model_.fields[decl].type);
        if (member.length > 0) {
          entry.summary += "[" + std::to_string(member.length) + "]";
        } else if (member.expr) {
          entry.summary += " = " + TextOf(*member.expr);
        }
      } else if (member.kind == MemberKind::kLabel) {
        const auto key = std::pair(OwnerOfLabel(r, member.name), member.name);
        const auto found = labels_.find(key);
        if (found != labels_.end()) {
          table_.Use(member.name_span, found->second, true);
          continue;
        }
        const int thing =
            table_.Declare(NameKind::kLabel, member.name, member.name_span, roles_[r]);
        table_.things[thing].extent = member.span;
        if (member.expr) {
          table_.things[thing].summary = "label " + member.name + " = " + TextOf(*member.expr);
        }
        labels_.emplace(key, thing);
      }
    }
  }

  /// What runs: one thing for all members that replace each other.
  void DeclareMember(const Routine& routine) {
    if (routine.signature < 0) return;
    signatures_.resize(model_.signatures.size(), -1);
    const Member& member = *routine.member;
    int& thing = signatures_[routine.signature];
    if (thing >= 0) return table_.Use(member.name_span, thing, true);
    thing =
        table_.Declare(KindOf(member.kind), member.name, member.name_span, RoleThing(routine.role));
    const Signature& signature = model_.signatures[routine.signature];
    std::string summary = NameOf(member.kind) + " " + member.name + "(";
    for (size_t i = 0; i < member.parameters.size(); ++i) {
      const Type type = i < signature.parameters.size() ? signature.parameters[i] : Type::kUnknown;
      summary += (i > 0 ? ", " : "") + Typed(member.parameters[i].name, type);
    }
    summary += ")";
    if (signature.result != Type::kVoid) summary += ": " + WordOf(signature.result);
    table_.things[thing].extent = member.span;
    table_.things[thing].summary = summary;
  }

  // --- Names in code

  void UseInRoutine(int index) {
    const Routine& routine = model_.routines[index];
    role_ = routine.role;
    routine_ = &routine;
    locals_.assign(routine.locals.size(), -1);
    const Member& member = *routine.member;
    for (size_t i = 0; i < member.parameters.size() && i < locals_.size(); ++i) {
      const Parameter& parameter = member.parameters[i];
      DeclareLocal(static_cast<int>(i), parameter.name, parameter.span);
      if (parameter.type == Type::kUnknown) Infer(parameter.span, routine.locals[i]);
    }
    Use(member.expr.get());
    if (member.body) Use(*member.body);
    routine_ = nullptr;
  }

  void Infer(const Span& span, Type type) {
    if (const std::string word = WordOf(type); !word.empty()) {
      table_.inferred.push_back({span, word});
    }
  }

  void DeclareLocal(int slot, const std::string& name, const Span& span) {
    int owner = -1;
    if (routine_->signature >= 0) owner = signatures_[routine_->signature];
    locals_[slot] = table_.Declare(NameKind::kVariable, name, span, owner);
    table_.things[locals_[slot]].summary = "variable " + Typed(name, routine_->locals[slot]);
  }

  void Use(const Stmt& statement) {
    const bool local = statement.meaning == Meaning::kLocal && routine_ != nullptr &&
                       statement.kind != StmtKind::kSwitch && statement.index >= 0 &&
                       statement.index < std::ssize(locals_);
    const bool element = statement.meaning == Meaning::kLocalElement && routine_ != nullptr;
    if (element) {
      table_.Use(statement.name_span, locals_[statement.index]);
    } else if (statement.kind == StmtKind::kForEach && local) {
      DeclareLocal(statement.index, statement.name, statement.name_span);
    } else if (statement.kind == StmtKind::kVar && local) {
      DeclareLocal(statement.index, statement.name, statement.name_span);
      for (int i = 1; i < statement.length; ++i) {
        if (statement.index + i < std::ssize(locals_)) {
          locals_[statement.index + i] = locals_[statement.index];
        }
      }
      Infer(statement.name_span, routine_->locals[statement.index]);
    } else if (local) {
      table_.Use(statement.name_span, locals_[statement.index]);
    } else if (statement.meaning == Meaning::kField ||
               statement.meaning == Meaning::kFieldElement) {
      table_.Use(statement.name_span, FieldThing(role_, statement.index));
    }
    Use(statement.subscript.get());
    Use(statement.expr.get());
    for (const SwitchCase& one : statement.cases) {
      for (const ExprPtr& value : one.values) Use(value.get());
    }
    for (const StmtPtr& inner : statement.body) {
      if (inner) Use(*inner);
    }
  }

  [[nodiscard]] int FieldThing(int role, int slot) const {
    if (role < 0 || slot < 0 || slot >= std::ssize(model_.roles[role].fields)) return -1;
    return fields_[model_.roles[role].fields[slot].decl];
  }

  [[nodiscard]] int SignatureOf(int role, const std::vector<NamedSlot> RoleModel::*slots,
                                int slot) const {
    if (role < 0 || slot < 0 || slot >= std::ssize(model_.roles[role].*slots)) return -1;
    const int signature = model_.routines[(model_.roles[role].*slots)[slot].routine].signature;
    return signature < 0 ? -1 : signatures_[signature];
  }

  void Use(const Expr* expr) {
    if (expr == nullptr) return;
    UseMeaning(*expr);
    for (const ExprPtr& operand : expr->operands) Use(operand.get());
  }

  /// The name that an expression itself has; of a call that of what is called.
  void UseMeaning(const Expr& expr) {
    const bool call = expr.kind == ExprKind::kCall && !expr.operands.empty();
    const Expr& named = call ? *expr.operands[0] : expr;
    const Span& span = named.kind == ExprKind::kName ? named.span : named.name_span;
    switch (expr.meaning) {
      case Meaning::kFieldElement:
        return table_.Use(span, FieldThing(role_, expr.index));
      case Meaning::kLocalElement:
      case Meaning::kLocal:
        if (expr.index >= 0 && expr.index < std::ssize(locals_)) {
          table_.Use(span, locals_[expr.index]);
        }
        return;
      case Meaning::kField:
        return table_.Use(span, FieldThing(role_, expr.index));
      case Meaning::kLabel:
        return UseLabel(expr, span);
      case Meaning::kParameter:
        return table_.Use(span, constants_[expr.index]);
      case Meaning::kConstant:
        return UseConstant(expr, span);
      case Meaning::kKeyword:
        return UseKeyword(span, expr.name);
      case Meaning::kMethod:
        return table_.Use(span, SignatureOf(role_, &RoleModel::methods, expr.index));
      case Meaning::kInvoke:
        // The role stands before the dot, where it is no expression of its own.
        if (!named.operands.empty()) {
          table_.Use(named.operands[0]->span, RoleThing(expr.role));
        }
        [[fallthrough]];
      case Meaning::kInvokeNear:
        return table_.Use(span, SignatureOf(expr.role, &RoleModel::commands, expr.index));
      case Meaning::kNeighbourField:
        return table_.Use(span, FieldThing(expr.role, expr.index));
      case Meaning::kSuper: {
        const int signature = model_.routines[expr.index].signature;
        return table_.Use(span, signature < 0 ? -1 : signatures_[signature]);
      }
      case Meaning::kBuiltin:
      case Meaning::kCount:
      case Meaning::kConvert:
      case Meaning::kOverNeighbours:
        return UseBuiltin(named, span);
      case Meaning::kNone:
        // A sensor has no value by itself, and so no meaning.
        if (named.kind == ExprKind::kMember && !named.operands.empty() &&
            named.operands[0]->kind == ExprKind::kSelf &&
            keywords_.Find(vm::KeywordKind::kSensor, named.name) >= 0) {
          UseKeyword(span, named.name);
        }
        return;
    }
  }

  void UseLabel(const Expr& expr, const Span& span) {
    if (role_ < 0 || expr.index < 0 || expr.index >= std::ssize(model_.roles[role_].labels)) return;
    const std::string& name = model_.roles[role_].labels[expr.index].name;
    const auto found = labels_.find(std::pair(OwnerOfLabel(role_, name), name));
    if (found != labels_.end()) table_.Use(span, found->second);
  }

  /// A role or a direction behind '$', or a constant of the program.
  void UseConstant(const Expr& expr, const Span& span) {
    if (expr.kind == ExprKind::kName || expr.kind == ExprKind::kMember) {
      const bool full = expr.kind == ExprKind::kMember;
      const int constant = full ? expr.index : model_.FindConstant(role_, expr.name);
      if (constant < 0 && expr.name == kPiName) {
        return table_.Use(span, Word(NameKind::kBuiltin, expr.name, "PI = 3.14159"));
      }
      // The name of the enumeration stands before the dot, where it is no expression of its own.
      if (constant >= 0 && full) {
        table_.Use(expr.operands[0]->span, enumerations_[model_.constants[constant].enumeration]);
      }
      return table_.Use(span, constant < 0 ? -1 : constants_[constant]);
    }
    if (expr.kind != ExprKind::kDollar) return;
    if (FindDirection(expr.name) != nullptr) {
      return table_.Use(expr.span,
                        Word(NameKind::kBuiltin, "$" + expr.name, "a direction or axis"));
    }
    table_.Use(expr.span, RoleThing(model_.FindRole(expr.name)));
  }

  void UseKeyword(const Span& span, const std::string& spelling) {
    table_.Use(span, Word(NameKind::kKeyword, spelling, ""));
  }

  void UseBuiltin(const Expr& named, const Span& span) {
    for (const auto* table : {&SelfBuiltins(), &FunctionBuiltins(), &NeighbourBuiltins(),
                              &JointBuiltins(), &ConnectorBuiltins(), &SensorBuiltins()}) {
      const std::string usages = UsagesOf(*table, named.name);
      if (!usages.empty()) return table_.Use(span, Word(NameKind::kBuiltin, named.name, usages));
    }
    // What sets or reads the state of a connector is named after it.
    for (const char* prefix : {"SET_", "GET_"}) {
      if (named.name.starts_with(prefix)) return UseKeyword(span, named.name.substr(4));
    }
    if (named.name == "print") {
      table_.Use(span, Word(NameKind::kBuiltin, named.name, "print(\"text\", value, ...)"));
    } else if (named.name == "int" || named.name == "float") {
      table_.Use(span, Word(NameKind::kBuiltin, named.name, named.name + "(x)"));
    } else if (named.name == "sizeof") {
      table_.Use(span, Word(NameKind::kBuiltin, named.name, "sizeof(set)"));
    }
  }

  /// A word that no text declares; each is one thing.
  int Word(NameKind kind, const std::string& name, const std::string& summary) {
    const auto [entry, fresh] = words_.try_emplace(std::pair(kind, name), -1);
    if (fresh) {
      entry->second = table_.Add(kind, name);
      table_.things[entry->second].summary = summary;
    }
    return entry->second;
  }

  const source::SourceSet& sources_;
  const keywords::KeywordTable& keywords_;
  const ProgramModel& model_;
  NameTable table_;
  // The things that roles, constants, fields and signatures of the model are, by their indices.
  std::vector<int> roles_, enumerations_, constants_, fields_, signatures_;
  std::map<std::pair<int, std::string>, int> labels_;  ///< By the role that declares it first.
  std::map<std::pair<NameKind, std::string>, int> words_;
  /// The role and routine whose code is walked over, and the things that its locals are.
  int role_ = -1;
  const Routine* routine_ = nullptr;
  std::vector<int> locals_;
};

}  // namespace

source::NameTable IndexNames(const source::SourceSet& sources,
                             const keywords::KeywordTable& keywords, const ProgramModel& model) {
  return Indexer(sources, keywords, model).Index();
}

}  // namespace morphbus::dynarole
