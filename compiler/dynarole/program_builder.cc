// A program's roles with all that they inherit, from the tree that was parsed.
#include <algorithm>
#include <map>
#include <numeric>
#include <utility>

#include "compiler/dynarole/builtins.h"
#include "compiler/dynarole/names_used.h"
#include "compiler/dynarole/program_model.h"

namespace morphbus::dynarole {

namespace {

using source::Diagnostic;
using source::Diagnostics;
using source::NearestHint;

// Puts the model together role by role, a role after the one it extends.
class Builder {
 public:
  Builder(Program* program, Diagnostics* diagnostics) : diagnostics_(*diagnostics) {
    model_.program = program;
  }

  ProgramModel Build() {
    // Roles may be used before they are declared, so all are known first.
    CollectRoles();
    ResolveParents();
    // A role is filled after the one that it extends, whose tables it begins with.
    std::vector<int> order(model_.roles.size());
    std::iota(order.begin(), order.end(), 0);
    std::ranges::stable_sort(order, {}, [this](int role) { return model_.roles[role].depth; });
    CheckEnumerations();
    for (ConstantDecl& constant : model_.program->constants) AddConstant(-1, &constant);
    for (const int role : order) FillRole(role);
    // The image counts functions over all roles.
    if (model_.routines.size() > vm::kMaxFunctions) {
      diagnostics_
          .Error(model_.routines[vm::kMaxFunctions].member->name_span,
                 "too many functions, requirements and labels in one program")
          .hint = "at most " + std::to_string(vm::kMaxFunctions);
    }
    return std::move(model_);
  }

 private:
  void CollectRoles() {
    // Functions outside all roles are members of the role that all others extend.
    if (Role* root = model_.program->root.get(); root != nullptr) {
      RoleModel& entry = model_.roles.emplace_back();
      entry.role = root;
      entry.name = root->name;
    }
    for (Role& role : model_.program->roles) {
      // A role that is left out here causes no further messages where it is used under its name.
      const int before = model_.FindRole(role.name);
      if (before >= 0 && role.name != "Module") {
        diagnostics_.Error(role.name_span, "role '" + role.name + "' is declared twice")
            .Note(model_.roles[before].role->name_span, "first declared here");
        continue;
      }
      if (role.name == "Module") {
        diagnostics_.Error(role.name_span, "'Module' is the built-in root of all roles").hint =
            "give the role another name";
        continue;
      }
      // Behind `$`, directions and axes come before roles.
      if (FindDirection(role.name) != nullptr) {
        diagnostics_.Error(role.name_span, "'" + role.name + "' names a direction or an axis")
            .hint = "give the role another name: $" + role.name + " could not mean it";
        continue;
      }
      if (model_.roles.size() == vm::kMaxRoles) {
        diagnostics_.Error(role.name_span, "too many roles in one program").hint =
            "at most " + std::to_string(vm::kMaxRoles);
        return;
      }
      RoleModel& entry = model_.roles.emplace_back();
      entry.role = &role;
      entry.name = role.name;
    }
  }

  // Finds what each role extends, cuts circles, and counts how deep each role stands.
  void ResolveParents() {
    std::vector<std::string> names = {"Module"};
    for (const RoleModel& role : model_.roles) names.push_back(role.name);
    for (RoleModel& role : model_.roles) {
      if (role.role == model_.program->root.get()) continue;
      role.parent = model_.FindRole(role.role->base);
      if (role.role->base == "Module") continue;
      if (role.parent >= 0) continue;
      // What such a role inherits is not known, so nothing in it is called unknown.
      role.broken = true;
      diagnostics_.Error(role.role->base_span, "unknown role '" + role.role->base + "'").hint =
          NearestHint(role.role->base, names,
                      "a role extends Module or another role of the program");
    }
    for (size_t i = 0; i < model_.roles.size(); ++i) BreakCircle(static_cast<int>(i));
    // Without circles every chain of roles ends, and depths can be counted.
    for (RoleModel& role : model_.roles) {
      for (int r = role.parent; r >= 0; r = model_.roles[r].parent) {
        ++role.depth;
        role.broken = role.broken || model_.roles[r].broken;
      }
    }
  }

  void BreakCircle(int start) {
    // Follows the chain of bases; if it comes back to where it began, the circle is cut there.
    RoleModel& first = model_.roles[start];
    std::string path = first.name;
    int role = first.parent;
    for (size_t steps = 0; role >= 0 && steps <= model_.roles.size(); ++steps) {
      const RoleModel& entry = model_.roles[role];
      path += " -> " + entry.name;
      if (role == start) {
        diagnostics_.Error(first.role->base_span, "role '" + first.name + "' extends itself").hint =
            path;
        first.parent = -1;
        first.broken = true;
        return;
      }
      role = entry.parent;
    }
  }

  // Adds a role's own members to those it inherits.
  void FillRole(int index) {
    // The tables of the base role come first, so that its slots stay what they are.
    RoleModel& role = model_.roles[index];
    if (role.parent >= 0) static_cast<RoleMembers&>(role) = model_.roles[role.parent];
    // Constants come first, as members may not have their names.
    for (ConstantDecl& constant : role.role->constants) AddConstant(index, &constant);
    // Two members of one role cannot share a name, whatever their kinds.
    std::map<std::string, const Member*> own;
    for (Member& member : role.role->members) {
      if (member.kind != MemberKind::kRequire) {
        // The elements of an array are declared at once.
        const auto [it, is_new] = own.emplace(member.declared_name(), &member);
        const bool with_first = member.element > 0 && it->second->length == member.length;
        if (!is_new && !with_first) {
          if (member.element > 0) continue;
          diagnostics_
              .Error(member.name_span,
                     "'" + member.declared_name() + "' is declared twice in '" + role.name + "'")
              .Note(it->second->name_span, "first declared here");
          continue;
        }
      }
      AddMember(index, &member);
    }
    AddImpliedFields(index);
    AddTraces(index);
    // What is inherited counts too, so the capacities are checked last.
    CheckCapacities(&role);
  }

  // Enumerations are known by their names in the whole program.
  void CheckEnumerations() {
    std::map<std::string, source::Span> seen;
    for (const Enumeration& enumeration : model_.program->enumerations) {
      if (const int role = model_.FindRole(enumeration.name); role >= 0) {
        diagnostics_
            .Error(enumeration.name_span,
                   "enumeration '" + enumeration.name + "' has the name of a role")
            .Note(model_.roles[role].role->name_span, "declared here");
      }
      const auto [before, fresh] = seen.try_emplace(enumeration.name, enumeration.name_span);
      if (fresh) continue;
      diagnostics_
          .Error(enumeration.name_span, "enumeration '" + enumeration.name + "' is declared twice")
          .Note(before->second, "first declared here");
    }
  }

  // A constant keeps its value in all subroles, so its name means nothing else there.
  void AddConstant(int role, ConstantDecl* constant) {
    const std::string kind = constant->least != nullptr ? "parameter" : "constant";
    const int before = model_.FindConstant(role, constant->name);
    if (before >= 0 && (role < 0 || model_.constants[before].role >= 0)) {
      diagnostics_.Error(constant->name_span, kind + " '" + constant->name + "' is declared twice")
          .Note(model_.constants[before].span, "first declared here");
      return;
    }
    // A field may have the name above; a member of the same role is found when it is added.
    for (int r = role < 0 ? -1 : model_.roles[role].parent; r >= 0; r = model_.roles[r].parent) {
      for (const Member& inherited : model_.roles[r].role->members) {
        if (inherited.declared_name() != constant->name || inherited.element > 0 ||
            inherited.kind == MemberKind::kRequire) {
          continue;
        }
        diagnostics_
            .Error(constant->name_span, kind + " '" + constant->name +
                                            "' has the name of an inherited " +
                                            NameOf(inherited.kind))
            .Note(inherited.name_span, "declared in '" + model_.roles[r].name + "'");
        return;
      }
    }
    model_.constants_by_name[constant->name].push_back(static_cast<int>(model_.constants.size()));
    ConstantModel& entry = model_.constants.emplace_back();
    entry.name = constant->name;
    entry.span = constant->name_span;
    entry.expr = constant->expr.get();
    entry.least = constant->least.get();
    entry.most = constant->most.get();
    entry.role = role;
    entry.enumeration = constant->enumeration;
  }

  // A constant of the role or above it has the member's name.
  bool IsConstant(int role, const Member& member) {
    // One outside all roles is hidden by the member, which is allowed.
    const int constant = model_.FindConstant(role, member.declared_name());
    if (constant < 0 || model_.constants[constant].role < 0) return false;
    // Of an array it is said once.
    if (member.element > 0) return true;
    diagnostics_
        .Error(member.name_span, NameOf(member.kind) + " '" + member.declared_name() +
                                     "' has the name of a " + model_.constants[constant].Kind())
        .Note(model_.constants[constant].span, "declared here")
        .hint =
        model_.constants[constant].Kind() + "s cannot be replaced; give one of them another name";
    return true;
  }

  // Puts one member into the table of its kind.
  void AddMember(int index, Member* member) {
    RoleModel& role = model_.roles[index];
    // Requirements add up; nothing replaces one.
    if (member->kind == MemberKind::kRequire) {
      role.requirements.push_back(AddRoutine(index, member, -1));
      return;
    }
    // A call of such a function could not be told from the built-in one.
    if (member->name == "sizeof") {
      diagnostics_.Error(member->name_span, "'sizeof' is built in and cannot be declared");
      return;
    }
    // Everything else has a name, and may replace what is inherited under it.
    if (IsConstant(index, *member)) return;
    if (!FitsInherited(role, *member)) return;
    if (member->kind == MemberKind::kField) {
      AddField(&role, *member);
      return;
    }
    if (member->kind == MemberKind::kHandler && (!IsEvent(*member) || !TakesSubject(member)))
      return;
    std::vector<NamedSlot>& slots = *SlotsOf(&role, member->kind);
    const int slot = FindSlot(slots, member->name);
    // Labels have no parameters, so that a new one always fits the one that it replaces.
    const bool has_parameters = member->kind != MemberKind::kLabel;
    int signature = -1;
    if (has_parameters && slot < 0) signature = AddSignature(*member);
    if (has_parameters && slot >= 0) {
      signature = model_.routines[slots[slot].routine].signature;
      // Callers know only the signature of the slot, which the new routine must keep.
      if (!Overrides(*member, signature)) return;
    }
    // The routine takes the slot of the one that it replaces, or a new one.
    const int routine = AddRoutine(index, member, signature);
    if (slot >= 0) {
      slots[slot].routine = routine;
    } else {
      slots.push_back({member->name, routine});
    }
  }

  // A name means one kind of member in a role and all roles that extend it.
  bool FitsInherited(const RoleModel& role, const Member& member) {
    // The name may have been declared by any role above.
    for (int r = role.parent; r >= 0; r = model_.roles[r].parent) {
      const RoleModel& base = model_.roles[r];
      for (const Member& inherited : base.role->members) {
        if (inherited.declared_name() != member.declared_name() ||
            inherited.kind == MemberKind::kRequire || inherited.kind == member.kind) {
          continue;
        }
        if (member.element > 0) return false;
        Diagnostic& error = diagnostics_.Error(
            member.name_span, NameOf(member.kind) + " '" + member.declared_name() +
                                  "' has the name of an inherited " + NameOf(inherited.kind));
        // The user needs the place of the other one, which may be far above.
        error.notes.push_back({inherited.name_span, "declared in '" + base.name + "'"});
        return false;
      }
    }
    return true;
  }

  bool IsEvent(const Member& member) {
    // The name of a handler is the event that it runs on; one that names its period is a timer.
    const std::vector<std::string> events(std::begin(kEventNames), std::end(kEventNames));
    const bool timer = member.name == kEventNames[static_cast<int>(vm::Event::kTimer)];
    const bool event = std::ranges::count(events, member.name) > 0;
    if (member.period != nullptr && event && !timer) {
      diagnostics_.Error(member.name_span, "'" + member.name + "' is no timer and has no period")
          .hint = "give the handler another name, or leave 'every' out";
      return false;
    }
    if (event || member.period != nullptr) return true;
    diagnostics_.Error(member.name_span, "unknown event '" + member.name + "'").hint = NearestHint(
        member.name, events,
        "events are on_connect, on_disconnect, on_stall and on_timer; a timer of another name says "
        "its period: handler " +
            member.name +
            "() every 0.5 {"
            "...}");
    return false;
  }

  // Handlers may take what their event is about, and nothing else.
  bool TakesSubject(Member* member) {
    const auto event = std::ranges::find(kEventNames, member->name) - std::begin(kEventNames);
    // Of each event; timers are about nothing.
    constexpr Type kSubjects[] = {Type::kConnector, Type::kConnector, Type::kJoint, Type::kVoid};
    const Type subject = event < std::ssize(kSubjects) ? kSubjects[event] : Type::kVoid;
    // A handler need not take it.
    if (member->parameters.empty()) return true;
    Parameter& first = member->parameters[0];
    if (subject == Type::kVoid || member->parameters.size() > 1) {
      diagnostics_
          .Error(member->parameters[subject == Type::kVoid ? 0 : 1].span,
                 "handler '" + member->name + "' takes " +
                     (subject == Type::kVoid ? "no parameter" : "at most one parameter"))
          .hint = subject == Type::kVoid ? "" : "it is what the event is about: " + NameOf(subject);
      return false;
    }
    if (first.type != Type::kUnknown && first.type != subject) {
      diagnostics_.Error(first.span, "handler '" + member->name + "' is about " + NameOf(subject) +
                                         ", not " + NameOf(first.type));
      return false;
    }
    first.type = subject;
    return true;
  }

  void AddField(RoleModel* role, const Member& member) {
    if (!FitsInheritedLength(*role, member)) return;
    // A field keeps its slot and its type in all subroles; only the value is replaced.
    const int inherited = model_.FindField(*role, member.name);
    if (inherited >= 0 && member.shared && !model_.fields[role->fields[inherited].decl].shared) {
      diagnostics_.Error(member.name_span, "inherited field '" + member.name + "' is not shared")
          .Note(model_.fields[role->fields[inherited].decl].span, "write 'shared' here");
      return;
    }
    if (inherited >= 0 && member.kept && !model_.fields[role->fields[inherited].decl].kept) {
      diagnostics_
          .Error(member.name_span, "inherited field '" + member.declared_name() + "' is not kept")
          .Note(model_.fields[role->fields[inherited].decl].span, "write 'kept' here");
      return;
    }
    if (inherited >= 0 && member.expr != nullptr) {
      role->fields[inherited].value = &member;
      return;
    }
    if (inherited >= 0) {
      // Where it is implied this is its declaration.
      if (model_.fields[role->fields[inherited].decl].implied) return;
      if (member.element > 0) return;
      diagnostics_
          .Warning(member.name_span, "field '" + member.declared_name() + "' is inherited already")
          .Note(model_.fields[role->fields[inherited].decl].span, "from here");
      return;
    }
    // It is new: declared here for this role and all that extend it.
    role->fields.push_back({.decl = static_cast<int>(model_.fields.size()),
                            .value = member.expr != nullptr ? &member : nullptr});
    model_.fields.push_back({.name = member.name,
                             .span = member.name_span,
                             .shared = member.shared,
                             .kept = member.kept,
                             .array = member.array,
                             .length = member.length});
  }

  // A field is one value or as many as before in all roles that have it.
  bool FitsInheritedLength(const RoleModel& role, const Member& member) {
    for (const FieldSlot& slot : role.fields) {
      const FieldDecl& decl = model_.fields[slot.decl];
      const std::string& name = decl.array.empty() ? decl.name : decl.array;
      if (name != member.declared_name() || decl.length == member.length) continue;
      if (member.element > 0) return false;
      const auto said = [](int length) {
        return length == 0 ? std::string("one value") : "an array of " + std::to_string(length);
      };
      diagnostics_
          .Error(member.name_span, "field '" + name + "' is " + said(member.length) +
                                       " here, but " + said(decl.length) +
                                       " where it is inherited "
                                       "from")
          .Note(decl.span, "declared here");
      return false;
    }
    return true;
  }

  // Code of a base role may use a field that only its subroles declare ("in the subclasses", Fig.
  // 10 of the paper), if every concrete one has it: whichever is played, the field is there.
  void AddImpliedFields(int index) {
    RoleModel& role = model_.roles[index];
    if (!role.role->abstract_role) return;
    for (const std::string& name : NamesUsedIn(*role.role)) {
      if (model_.FindField(role, name) >= 0 || FindSlot(role.labels, name) >= 0 ||
          model_.FindConstant(index, name) >= 0) {
        continue;
      }
      // A name that is no field of all subroles either is left for the checker to report.
      const Member* declaration = model_.FieldOfSubroles(index, name, nullptr);
      if (declaration == nullptr) continue;
      role.fields.push_back({.decl = static_cast<int>(model_.fields.size())});
      model_.fields.push_back({.name = name,
                               .span = declaration->name_span,
                               .implied = true,
                               .shared = declaration->shared,
                               .kept = declaration->kept});
    }
  }

  // Fields that are traced are so in all roles that extend this one.
  void AddTraces(int index) {
    RoleModel& role = model_.roles[index];
    for (const Trace& trace : role.role->traces) {
      const int slot = model_.FindField(role, trace.name);
      if (slot >= 0) {
        role.fields[slot].traced = true;
        model_.fields[role.fields[slot].decl].read = true;
        continue;
      }
      if (role.broken) continue;
      Diagnostic& error = diagnostics_.Error(
          trace.span, "role '" + role.name + "' has no field '" + trace.name + "'");
      std::vector<std::string> names;
      for (const FieldSlot& field : role.fields) names.push_back(model_.fields[field.decl].name);
      error.hint = model_.FindArray(role, trace.name) >= 0
                       ? "it is an array; trace its elements: trace " + trace.name + "[0];"
                       : NearestHint(trace.name, names, "what is traced is a field of the role");
    }
  }

  // Whether a member may replace the inherited one with this signature; reports why not.
  bool Overrides(const Member& member, int signature) {
    // Whatever replaces a routine is called in its place, so it takes the same arguments. A type
    // that is written in one of them counts for all.
    const Signature& inherited = model_.signatures[signature];
    if (inherited.parameters.size() == member.parameters.size()) {
      for (size_t i = 0; i < member.parameters.size(); ++i) {
        Type& type = model_.signatures[signature].parameters[i];
        const Type written = member.parameters[i].type;
        if (written == Type::kUnknown || written == type) continue;
        if (type == Type::kUnknown) {
          type = written;
          continue;
        }
        diagnostics_
            .Error(member.parameters[i].span, "parameter is " + NameOf(written) + ", but " +
                                                  NameOf(type) + " in the inherited " +
                                                  NameOf(member.kind))
            .Note(inherited.span, "inherited from here");
        return false;
      }
      return true;
    }
    diagnostics_
        .Error(member.name_span, NameOf(member.kind) + " '" + member.name + "' has " +
                                     std::to_string(member.parameters.size()) +
                                     " parameters, but the inherited one has " +
                                     std::to_string(inherited.parameters.size()))
        .Note(inherited.span, "inherited from here");
    return false;
  }

  int AddSignature(const Member& member) {
    // Types that are not written are found by the checker.
    Signature& signature = model_.signatures.emplace_back();
    signature.kind = member.kind;
    signature.name = member.name;
    signature.span = member.name_span;
    for (const Parameter& parameter : member.parameters) {
      signature.parameters.push_back(parameter.type);
    }
    signature.from_call.assign(member.parameters.size(), false);
    // A command travels in a message of fixed size; a function's parameters take cells of its task.
    const size_t most = member.kind == MemberKind::kCommand    ? vm::kMaxArguments
                        : member.kind == MemberKind::kFunction ? 8
                        : member.kind == MemberKind::kHandler  ? 1
                                                               : 0;
    if (member.parameters.size() > most) {
      diagnostics_.Error(
          member.parameters[most].span,
          "a " + NameOf(member.kind) + " has at most " + std::to_string(most) + " parameters");
    }
    return static_cast<int>(model_.signatures.size()) - 1;
  }

  // Makes the function of the image for a member, and returns its index.
  int AddRoutine(int role, Member* member, int signature) {
    Routine& routine = model_.routines.emplace_back();
    routine.kind = member->kind;
    routine.role = role;
    routine.member = member;
    routine.signature = signature;
    const RoleModel& owner = model_.roles[role];
    // Faults show this name. Requirements have none of their own and are counted.
    routine.name = owner.name + "." +
                   (member->kind == MemberKind::kRequire
                        ? "require_" + std::to_string(owner.requirements.size() + 1)
                        : member->name);
    if (routine.name.size() > 255) routine.name.resize(255);
    return static_cast<int>(model_.routines.size()) - 1;
  }

  // The virtual machine has room for so many members of a role and no more.
  void CheckCapacities(RoleModel* role) {
    // The message is at the role, as no one member is to blame.
    const auto check = [&](size_t count, size_t most, const std::string& what) {
      // Too many functions outside all roles are too many for each role, which is said once.
      const bool is_root = role->role == model_.program->root.get();
      if (count <= most || (root_full_ && !is_root)) return;
      root_full_ = root_full_ || is_root;
      diagnostics_
          .Error(role->role->name_span, "role '" + role->name + "' has " + std::to_string(count) +
                                            " " + what + "s with those it inherits")
          .hint = "at most " + std::to_string(most);
    };
    check(role->fields.size(), vm::kMaxFields, "field");
    const auto shared = std::ranges::count_if(
        role->fields, [this](const FieldSlot& slot) { return model_.fields[slot.decl].shared; });
    check(static_cast<size_t>(shared), vm::kMaxSharedFields, "shared field");
    const auto kept = std::ranges::count_if(
        role->fields, [this](const FieldSlot& slot) { return model_.fields[slot.decl].kept; });
    check(static_cast<size_t>(kept), vm::kMaxKeptFields, "kept field");
    const auto traced =
        std::ranges::count_if(role->fields, [](const FieldSlot& slot) { return slot.traced; });
    check(static_cast<size_t>(traced), vm::kMaxTracedFields, "traced field");
    check(role->requirements.size(), vm::kMaxRequirements, "requirement");
    for (const MemberKind kind :
         {MemberKind::kLabel, MemberKind::kStartup, MemberKind::kBehavior, MemberKind::kCommand,
          MemberKind::kHandler, MemberKind::kFunction}) {
      const size_t most = kind == MemberKind::kLabel ? vm::kMaxLabels : vm::kMaxRoutines;
      check(SlotsOf(role, kind)->size(), most, NameOf(kind));
    }
  }

  ProgramModel model_;
  Diagnostics& diagnostics_;
  /// The root of all roles has too many members.
  bool root_full_ = false;
};

}  // namespace

ProgramModel BuildModel(Program* program, Diagnostics* diagnostics) {
  return Builder(program, diagnostics).Build();
}

}  // namespace morphbus::dynarole
