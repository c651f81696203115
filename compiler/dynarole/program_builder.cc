// A program's roles with all that they inherit, from the tree that was parsed.
#include <algorithm>
#include <map>
#include <numeric>
#include <utility>

#include "compiler/dynarole/builtins.h"
#include "compiler/dynarole/member_tables.h"
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
  Builder(Program* program, Diagnostics* diagnostics)
      : diagnostics_(*diagnostics), members_(&model_, diagnostics) {
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
      members_.Add(index, &member);
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

  // The virtual machine has room for so many members of a role and no more.
  void CheckCapacities(RoleModel* role) {
    const bool arrays = std::ranges::any_of(role->fields, [this](const FieldSlot& slot) {
      return model_.fields[slot.decl].length > 0;
    });
    const std::string elements = arrays ? "; each element of an array counts as one" : "";
    // The message is at the role, as no one member is to blame.
    const auto check = [&](size_t count, size_t most, const std::string& what,
                           const std::string& hint = "") {
      // Too many functions outside all roles are too many for each role, which is said once.
      const bool is_root = role->role == model_.program->root.get();
      if (count <= most || (root_full_ && !is_root)) return;
      root_full_ = root_full_ || is_root;
      diagnostics_
          .Error(role->role->name_span, "role '" + role->name + "' has " + std::to_string(count) +
                                            " " + what + "s" +
                                            (role->parent < 0 ? "" : " with those it inherits"))
          .hint = "at most " + std::to_string(most) + hint;
    };
    check(role->fields.size(), vm::kMaxFields, "field", elements);
    const auto shared = std::ranges::count_if(
        role->fields, [this](const FieldSlot& slot) { return model_.fields[slot.decl].shared; });
    check(static_cast<size_t>(shared), vm::kMaxSharedFields, "shared field");
    const auto kept = std::ranges::count_if(
        role->fields, [this](const FieldSlot& slot) { return model_.fields[slot.decl].kept; });
    check(static_cast<size_t>(kept), vm::kMaxKeptFields, "kept field", elements);
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
  MemberTables members_;
  /// The root of all roles has too many members.
  bool root_full_ = false;
};

}  // namespace

ProgramModel BuildModel(Program* program, Diagnostics* diagnostics) {
  return Builder(program, diagnostics).Build();
}

}  // namespace morphbus::dynarole
