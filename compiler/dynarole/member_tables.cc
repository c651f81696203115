#include "compiler/dynarole/member_tables.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "compiler/dynarole/builtins.h"

namespace morphbus::dynarole {

using source::Diagnostic;
using source::NearestHint;

bool MemberTables::IsConstant(int role, const Member& member) {
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

void MemberTables::Add(int index, Member* member) {
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
  if (member->kind == MemberKind::kHandler && (!IsEvent(*member) || !TakesSubject(member))) return;
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

bool MemberTables::FitsInherited(const RoleModel& role, const Member& member) {
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

bool MemberTables::IsEvent(const Member& member) {
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
          member.name + "() every 0.5 {...}");
  return false;
}

bool MemberTables::TakesSubject(Member* member) {
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

void MemberTables::AddField(RoleModel* role, const Member& member) {
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
                           .length = member.length,
                           .element = member.element});
}

bool MemberTables::FitsInheritedLength(const RoleModel& role, const Member& member) {
  for (const FieldSlot& slot : role.fields) {
    const FieldDecl& decl = model_.fields[slot.decl];
    const std::string& name = decl.declared_name();
    if (name != member.declared_name() || decl.length == member.length) continue;
    if (member.element > 0) return false;
    const auto said = [](int length) {
      return length == 0 ? std::string("one value") : "an array of " + std::to_string(length);
    };
    diagnostics_
        .Error(member.name_span, "field '" + name + "' is " + said(member.length) + " here, but " +
                                     said(decl.length) + " where it is inherited from")
        .Note(decl.span, "declared here");
    return false;
  }
  return true;
}

bool MemberTables::Overrides(const Member& member, int signature) {
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

int MemberTables::AddSignature(const Member& member) {
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
    diagnostics_.Error(member.parameters[most].span, "a " + NameOf(member.kind) + " has at most " +
                                                         std::to_string(most) + " parameters");
  }
  return static_cast<int>(model_.signatures.size()) - 1;
}

int MemberTables::AddRoutine(int role, Member* member, int signature) {
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

}  // namespace morphbus::dynarole
