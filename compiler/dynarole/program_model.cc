#include "compiler/dynarole/program_model.h"

#include <algorithm>
#include <functional>
#include <map>
#include <utility>

namespace morphbus::dynarole {

namespace {

using source::Diagnostic;
using source::Diagnostics;
using source::NearestName;

struct Capacity {
  MemberKind kind;
  size_t most;
};

constexpr Capacity kCapacities[] = {
    {MemberKind::kLabel, vm::kMaxLabels},      {MemberKind::kStartup, vm::kMaxRoutines},
    {MemberKind::kBehavior, vm::kMaxRoutines}, {MemberKind::kCommand, vm::kMaxRoutines},
    {MemberKind::kHandler, vm::kMaxRoutines},  {MemberKind::kFunction, vm::kMaxRoutines},
};

class Builder {
 public:
  Builder(Program* program, Diagnostics* diagnostics) : diagnostics_(*diagnostics) {
    model_.program = program;
  }

  ProgramModel Build() {
    CollectRoles();
    ResolveParents();
    std::vector<size_t> order(model_.roles.size());
    for (size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(), [this](size_t a, size_t b) {
      return model_.roles[a].depth < model_.roles[b].depth;
    });
    for (const size_t i : order) FillRole(static_cast<int>(i));
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
    for (Role& role : model_.program->roles) {
      const int before = model_.FindRole(role.name);
      if (before >= 0) {
        diagnostics_.Error(role.name_span, "role '" + role.name + "' is declared twice")
            .notes.push_back(
                {model_.roles[static_cast<size_t>(before)].role->name_span, "first declared here"});
        continue;
      }
      if (role.name == "Module") {
        diagnostics_.Error(role.name_span, "'Module' is the built-in root of all roles").hint =
            "give the role another name";
        continue;
      }
      if (model_.roles.size() == vm::kMaxRoles) {
        diagnostics_.Error(role.name_span, "too many roles in one program").hint =
            "at most " + std::to_string(vm::kMaxRoles);
        return;
      }
      RoleModel entry;
      entry.role = &role;
      entry.name = role.name;
      model_.roles.push_back(std::move(entry));
    }
  }

  void ResolveParents() {
    std::vector<std::string> names = {"Module"};
    for (const RoleModel& role : model_.roles) names.push_back(role.name);
    for (RoleModel& role : model_.roles) {
      if (role.role->base == "Module") continue;
      role.parent = model_.FindRole(role.role->base);
      if (role.parent >= 0) continue;
      role.broken = true;
      Diagnostic& error =
          diagnostics_.Error(role.role->base_span, "unknown role '" + role.role->base + "'");
      const std::string near = NearestName(role.role->base, names);
      error.hint = near.empty() ? "a role extends Module or another role of the program"
                                : "did you mean '" + near + "'?";
    }
    for (size_t i = 0; i < model_.roles.size(); ++i) BreakCircle(static_cast<int>(i));
    for (RoleModel& role : model_.roles) {
      for (int r = role.parent; r >= 0; r = model_.roles[static_cast<size_t>(r)].parent) {
        ++role.depth;
        role.broken = role.broken || model_.roles[static_cast<size_t>(r)].broken;
      }
    }
  }

  void BreakCircle(int start) {
    RoleModel& first = model_.roles[static_cast<size_t>(start)];
    std::string path = first.name;
    int role = first.parent;
    for (size_t steps = 0; role >= 0 && steps <= model_.roles.size(); ++steps) {
      const RoleModel& entry = model_.roles[static_cast<size_t>(role)];
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

  void FillRole(int index) {
    RoleModel& role = model_.roles[static_cast<size_t>(index)];
    if (role.parent >= 0) {
      const RoleModel& parent = model_.roles[static_cast<size_t>(role.parent)];
      role.fields = parent.fields;
      role.labels = parent.labels;
      role.requirements = parent.requirements;
      role.startups = parent.startups;
      role.behaviors = parent.behaviors;
      role.commands = parent.commands;
      role.handlers = parent.handlers;
      role.methods = parent.methods;
    }
    std::map<std::string, const Member*> own;
    for (Member& member : role.role->members) {
      if (member.kind != MemberKind::kRequire) {
        const auto [it, is_new] = own.emplace(member.name, &member);
        if (!is_new) {
          diagnostics_
              .Error(member.name_span,
                     "'" + member.name + "' is declared twice in '" + role.name + "'")
              .notes.push_back({it->second->name_span, "first declared here"});
          continue;
        }
      }
      AddMember(index, &member);
    }
    CheckCapacities(role);
  }

  void AddMember(int index, Member* member) {
    RoleModel& role = model_.roles[static_cast<size_t>(index)];
    if (member->kind == MemberKind::kRequire) {
      role.requirements.push_back(AddRoutine(index, member, -1));
      return;
    }
    if (member->name == "sizeof") {
      diagnostics_.Error(member->name_span, "'sizeof' is built in and cannot be declared");
      return;
    }
    if (!FitsInherited(role, *member)) return;
    if (member->kind == MemberKind::kField) {
      AddField(&role, *member);
      return;
    }
    if (member->kind == MemberKind::kHandler && !IsEvent(*member)) return;
    std::vector<NamedSlot>& slots = *SlotsOf(&role, member->kind);
    const int slot = FindSlot(slots, member->name);
    if (member->kind == MemberKind::kLabel) {
      const int routine = AddRoutine(index, member, -1);
      if (slot >= 0) {
        slots[static_cast<size_t>(slot)].routine = routine;
      } else {
        slots.push_back({member->name, routine});
      }
      return;
    }
    int signature = -1;
    if (slot >= 0) {
      const int overridden = slots[static_cast<size_t>(slot)].routine;
      signature = model_.routines[static_cast<size_t>(overridden)].signature;
      if (!Overrides(*member, signature)) return;
    } else {
      signature = AddSignature(*member);
    }
    const int routine = AddRoutine(index, member, signature);
    if (slot >= 0) {
      slots[static_cast<size_t>(slot)].routine = routine;
    } else {
      slots.push_back({member->name, routine});
    }
  }

  // A name means one kind of member in a role and all roles that extend it.
  bool FitsInherited(const RoleModel& role, const Member& member) {
    for (int r = role.parent; r >= 0; r = model_.roles[static_cast<size_t>(r)].parent) {
      const RoleModel& base = model_.roles[static_cast<size_t>(r)];
      for (const Member& inherited : base.role->members) {
        if (inherited.name != member.name || inherited.kind == MemberKind::kRequire ||
            inherited.kind == member.kind) {
          continue;
        }
        Diagnostic& error = diagnostics_.Error(
            member.name_span, std::string(NameOf(member.kind)) + " '" + member.name +
                                  "' has the name of an inherited " + NameOf(inherited.kind));
        error.notes.push_back({inherited.name_span, "declared in '" + base.name + "'"});
        return false;
      }
    }
    return true;
  }

  bool IsEvent(const Member& member) {
    const std::vector<std::string> events = {"on_connect", "on_disconnect", "on_stall", "on_timer"};
    if (std::find(events.begin(), events.end(), member.name) == events.end()) {
      const std::string near = NearestName(member.name, events);
      diagnostics_.Error(member.name_span, "unknown event '" + member.name + "'").hint =
          near.empty() ? "events are on_connect, on_disconnect, on_stall and on_timer"
                       : "did you mean '" + near + "'?";
      return false;
    }
    return true;
  }

  void AddField(RoleModel* role, const Member& member) {
    for (FieldSlot& slot : role->fields) {
      if (model_.fields[static_cast<size_t>(slot.decl)].name != member.name) continue;
      if (member.expr == nullptr) {
        diagnostics_.Warning(member.name_span, "field '" + member.name + "' is inherited already")
            .notes.push_back({model_.fields[static_cast<size_t>(slot.decl)].span, "from here"});
        return;
      }
      slot.value = &member;
      return;
    }
    FieldDecl decl;
    decl.name = member.name;
    decl.span = member.name_span;
    model_.fields.push_back(std::move(decl));
    FieldSlot slot;
    slot.decl = static_cast<int>(model_.fields.size()) - 1;
    slot.value = member.expr != nullptr ? &member : nullptr;
    role->fields.push_back(slot);
  }

  bool Overrides(const Member& member, int signature) {
    const Signature& inherited = model_.signatures[static_cast<size_t>(signature)];
    if (inherited.parameters.size() == member.parameters.size()) {
      for (size_t i = 0; i < member.parameters.size(); ++i) {
        Type& type = model_.signatures[static_cast<size_t>(signature)].parameters[i];
        const Type written = member.parameters[i].type;
        if (written == Type::kUnknown || written == type) continue;
        if (type == Type::kUnknown) {
          type = written;
          continue;
        }
        diagnostics_
            .Error(member.parameters[i].span, "parameter is " + std::string(NameOf(written)) +
                                                  ", but " + NameOf(type) + " in the inherited " +
                                                  NameOf(member.kind))
            .notes.push_back({inherited.span, "inherited from here"});
        return false;
      }
      return true;
    }
    diagnostics_
        .Error(member.name_span, std::string(NameOf(member.kind)) + " '" + member.name + "' has " +
                                     std::to_string(member.parameters.size()) +
                                     " parameters, but the inherited one has " +
                                     std::to_string(inherited.parameters.size()))
        .notes.push_back({inherited.span, "inherited from here"});
    return false;
  }

  int AddSignature(const Member& member) {
    Signature signature;
    signature.kind = member.kind;
    signature.name = member.name;
    signature.span = member.name_span;
    for (const Parameter& parameter : member.parameters) {
      signature.parameters.push_back(parameter.type);
    }
    signature.from_call.assign(member.parameters.size(), false);
    const size_t most = member.kind == MemberKind::kCommand    ? vm::kMaxArguments
                        : member.kind == MemberKind::kFunction ? 8
                                                               : 0;
    if (member.parameters.size() > most) {
      diagnostics_.Error(member.parameters[most].span, "a " + std::string(NameOf(member.kind)) +
                                                           " has at most " + std::to_string(most) +
                                                           " parameters");
    }
    model_.signatures.push_back(std::move(signature));
    return static_cast<int>(model_.signatures.size()) - 1;
  }

  int AddRoutine(int role, Member* member, int signature) {
    Routine routine;
    routine.kind = member->kind;
    routine.role = role;
    routine.member = member;
    routine.signature = signature;
    const RoleModel& owner = model_.roles[static_cast<size_t>(role)];
    routine.name = owner.name + "." +
                   (member->kind == MemberKind::kRequire
                        ? "require_" + std::to_string(owner.requirements.size() + 1)
                        : member->name);
    if (routine.name.size() > 255) routine.name.resize(255);
    model_.routines.push_back(std::move(routine));
    return static_cast<int>(model_.routines.size()) - 1;
  }

  void CheckCapacities(const RoleModel& role) {
    const auto check = [&](size_t count, size_t most, const char* what) {
      if (count <= most) return;
      diagnostics_
          .Error(role.role->name_span, "role '" + role.name + "' has " + std::to_string(count) +
                                           " " + what + "s with those it inherits")
          .hint = "at most " + std::to_string(most);
    };
    check(role.fields.size(), vm::kMaxFields, "field");
    check(role.requirements.size(), vm::kMaxRequirements, "requirement");
    RoleModel copy = role;
    for (const Capacity& capacity : kCapacities) {
      check(SlotsOf(&copy, capacity.kind)->size(), capacity.most, NameOf(capacity.kind));
    }
  }

  ProgramModel model_;
  Diagnostics& diagnostics_;
};

}  // namespace

int ProgramModel::FindRole(const std::string& name) const {
  for (size_t i = 0; i < roles.size(); ++i) {
    if (roles[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

bool ProgramModel::IsA(int role, int ancestor) const {
  while (role >= 0 && role != ancestor) role = roles[static_cast<size_t>(role)].parent;
  return role >= 0;
}

int FindSlot(const std::vector<NamedSlot>& slots, const std::string& name) {
  for (size_t i = 0; i < slots.size(); ++i) {
    if (slots[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

std::vector<NamedSlot>* SlotsOf(RoleModel* role, MemberKind kind) {
  switch (kind) {
    case MemberKind::kLabel:
      return &role->labels;
    case MemberKind::kStartup:
      return &role->startups;
    case MemberKind::kBehavior:
      return &role->behaviors;
    case MemberKind::kCommand:
      return &role->commands;
    case MemberKind::kHandler:
      return &role->handlers;
    default:
      return &role->methods;
  }
}

ProgramModel BuildModel(Program* program, Diagnostics* diagnostics) {
  return Builder(program, diagnostics).Build();
}

const char* NameOf(MemberKind kind) {
  switch (kind) {
    case MemberKind::kField:
      return "field";
    case MemberKind::kLabel:
      return "label";
    case MemberKind::kRequire:
      return "requirement";
    case MemberKind::kStartup:
      return "startup";
    case MemberKind::kBehavior:
      return "behavior";
    case MemberKind::kCommand:
      return "command";
    case MemberKind::kHandler:
      return "handler";
    case MemberKind::kFunction:
      return "function";
  }
  return "?";
}

const char* NameOf(Operator op) {
  constexpr const char* kNames[] = {
      "", "+", "-", "*", "/", "%", "==", "!=", "<", "<=", ">", ">=", "&&", "||", "!", "-"};
  return kNames[static_cast<int>(op)];
}

}  // namespace morphbus::dynarole
