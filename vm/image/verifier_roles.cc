// The role table: everything inherited is written out in it, so each role must be checked to agree
// with the one it extends; code compiled for a role then runs under all its subroles.
#include "vm/image/image.h"
#include "vm/image/opcodes.h"
#include "vm/image/verifier.h"

namespace morphbus::vm {

using image::ReadU16;
using image::ReadU32;
using image::Section;
using image::SectionOf;
using image::SectionRange;

namespace {

/// Calls visit(function) for every function that a role refers to, inherited ones included.
template <class Visit>
void ForEachFunction(const RoleInfo& role, const Visit& visit) {
  for (int i = 0; i < role.num_labels; ++i) visit(role.labels[i].function);
  for (int i = 0; i < role.num_requirements; ++i) visit(role.requirements[i]);
  for (int i = 0; i < role.num_startups; ++i) visit(role.startups[i].function);
  for (int i = 0; i < role.num_behaviors; ++i) visit(role.behaviors[i].function);
  for (int i = 0; i < role.num_commands; ++i) visit(role.commands[i].function);
  for (int i = 0; i < role.num_handlers; ++i) visit(role.handlers[i].function);
  for (int i = 0; i < role.num_methods; ++i) visit(role.methods[i]);
}

}  // namespace

// Roles have no fixed size, so they are read one after the other; where the last one ends must be
// where the next section begins.
bool Verifier::CheckRoles() {
  const SectionRange range = SectionOf(bytes_, Section::kRoles);
  if (range.count > kMaxRoles) return Fail("too many roles", range.begin);
  out_.num_roles_ = static_cast<int>(range.count);
  uint32_t at = range.begin;
  for (int i = 0; i < out_.num_roles_; ++i) {
    if (!CheckRoleHead(i, &at)) return false;
  }
  if (at != SectionOf(bytes_, Section::kJoins).begin) {
    return Fail("roles leave a gap or overlap", at);
  }
  if (!CheckParents()) return false;
  for (int i = 0; i < out_.num_roles_; ++i) {
    // Parents may stand behind their children, so agreement is checked once all are read.
    const RoleInfo& role = out_.roles_[i];
    if (role.parent >= 0 && !CheckAgainstParent(role, out_.roles_[role.parent])) return false;
  }
  return CheckOwners();
}

// A role's name, parent and counts, and with them the size of what follows.
bool Verifier::CheckRoleHead(int index, uint32_t* at) {
  const uint32_t limit = SectionOf(bytes_, Section::kJoins).begin;
  // The head must fit in front of the next section before any of it is read.
  const uint32_t head = *at;
  if (limit < head || limit - head < image::kRoleHeadBytes) return Fail("role is cut off", head);
  RoleInfo& role = out_.roles_[index];
  role = {};
  if (!CheckText(head, &role.name)) return false;
  role.parent = static_cast<int16_t>(ReadU16(bytes_ + head + 4));
  role.abstract_role = bytes_[head + 6] == 1;
  const uint8_t* counts = bytes_ + head + image::kRoleCountsAt;
  constexpr uint32_t kLimits[image::kRoleCounts] = {kMaxFields,   kMaxLabels,   kMaxRequirements,
                                                    kMaxRoutines, kMaxRoutines, kMaxRoutines,
                                                    kMaxRoutines, kMaxRoutines};
  for (int i = 0; i < image::kRoleCounts; ++i) {
    if (counts[i] > kLimits[i]) {
      return Fail("role has too many members", head + image::kRoleCountsAt);
    }
  }
  // Which role is extended is checked further below; here it only has to exist.
  if (role.name.size == 0 || bytes_[head + 6] > 1 || role.parent < -1 ||
      role.parent >= out_.num_roles_) {
    return Fail("bad head of a role", head);
  }
  *at = head + image::kRoleHeadBytes;
  if (limit - *at < image::RoleBodyBytes(counts)) return Fail("role is cut off", head);
  // The order of the counts is that of the records, which the checks below read one by one.
  role.num_fields = counts[0];
  role.num_labels = counts[1];
  role.num_requirements = counts[2];
  role.num_startups = counts[3];
  role.num_behaviors = counts[4];
  role.num_commands = counts[5];
  role.num_handlers = counts[6];
  role.num_methods = counts[7];
  return CheckFields(&role, at) && CheckLabels(&role, at) &&
         CheckFunctionRefs(role.requirements, role.num_requirements, true, at) &&
         CheckRoutines(role.startups, role.num_startups, false, at) &&
         CheckRoutines(role.behaviors, role.num_behaviors, false, at) &&
         CheckRoutines(role.commands, role.num_commands, true, at) && CheckHandlers(&role, at) &&
         CheckFunctionRefs(role.methods, role.num_methods, false, at);
}

// Each field has a first value of its type. Names are for people only.
bool Verifier::CheckFields(RoleInfo* role, uint32_t* at) {
  for (int i = 0; i < role->num_fields; ++i, *at += image::kFieldBytes) {
    Text name;
    if (!CheckText(*at, &name)) return false;
    role->field_types[i] = static_cast<ValueType>(bytes_[*at + 4]);
    role->fields[i] = Cell{ReadU32(bytes_ + *at + 5)};
    if (!IsValueOf(role->field_types[i], role->fields[i], out_.num_roles_)) {
      return Fail("field is not a value of its type", *at);
    }
  }
  return true;
}

// A label is found by a function without arguments that returns a joint or a link.
bool Verifier::CheckLabels(RoleInfo* role, uint32_t* at) {
  for (int i = 0; i < role->num_labels; ++i, *at += image::kLabelBytes) {
    LabelInfo& label = role->labels[i];
    if (!CheckText(*at, &label.name)) return false;
    label.type = static_cast<ValueType>(bytes_[*at + 4]);
    label.function = ReadU16(bytes_ + *at + 5);
    if (label.function >= out_.num_functions_) return Fail("label of no function", *at);
    const FunctionInfo& function = out_.functions_[label.function];
    if ((label.type != ValueType::kJoint && label.type != ValueType::kLink) ||
        function.return_type != label.type || function.num_arguments != 0) {
      return Fail("label does not fit its function", *at);
    }
  }
  return true;
}

// Requirements return a bool; methods may have any signature.
bool Verifier::CheckFunctionRefs(uint16_t* functions, int count, bool is_requirement,
                                 uint32_t* at) {
  for (int i = 0; i < count; ++i, *at += image::kReferenceBytes) {
    functions[i] = ReadU16(bytes_ + *at);
    if (functions[i] >= out_.num_functions_) return Fail("reference to no function", *at);
    const FunctionInfo& function = out_.functions_[functions[i]];
    if (is_requirement &&
        (function.return_type != ValueType::kBool || function.num_arguments != 0)) {
      return Fail("requirement does not yield a bool", *at);
    }
  }
  return true;
}

// Startups, behaviors and commands return nothing; only commands have arguments.
bool Verifier::CheckRoutines(RoutineInfo* routines, int count, bool is_command, uint32_t* at) {
  for (int i = 0; i < count; ++i, *at += image::kRoutineBytes) {
    if (!CheckText(*at, &routines[i].name)) return false;
    routines[i].function = ReadU16(bytes_ + *at + 4);
    if (routines[i].function >= out_.num_functions_) return Fail("reference to no function", *at);
    const FunctionInfo& function = out_.functions_[routines[i].function];
    if (function.return_type != ValueType::kVoid ||
        function.num_arguments > (is_command ? kMaxArguments : 0)) {
      return Fail("routine has a result or too many arguments", *at);
    }
    // Arguments of commands travel, so only values that mean the same everywhere are allowed.
    for (int k = 0; k < function.num_arguments; ++k) {
      if (function.local_types[k] > ValueType::kRole) {
        return Fail("argument of a command cannot travel", *at);
      }
    }
  }
  return true;
}

// A handler answers a known event and neither takes nor returns anything.
bool Verifier::CheckHandlers(RoleInfo* role, uint32_t* at) {
  for (int i = 0; i < role->num_handlers; ++i, *at += image::kHandlerBytes) {
    if (bytes_[*at] > static_cast<uint8_t>(Event::kTimer)) return Fail("unknown event", *at);
    HandlerInfo& handler = role->handlers[i];
    handler.event = static_cast<Event>(bytes_[*at]);
    handler.function = ReadU16(bytes_ + *at + 1);
    if (handler.function >= out_.num_functions_) return Fail("reference to no function", *at);
    const FunctionInfo& function = out_.functions_[handler.function];
    if (function.return_type != ValueType::kVoid || function.num_arguments != 0) {
      return Fail("handler has a result or arguments", *at);
    }
  }
  return true;
}

// Each role says how deep it stands below Module; if every depth is one more than the parent's,
// there are no cycles. Afterwards ancestors_ answers IsA in one step.
bool Verifier::CheckParents() {
  uint8_t depths[kMaxRoles] = {};
  uint32_t at = SectionOf(bytes_, Section::kRoles).begin;
  for (int i = 0; i < out_.num_roles_; ++i) {
    // The depth stands right before the counts, which say where the next role begins.
    depths[i] = bytes_[at + image::kRoleCountsAt - 1];
    at += image::kRoleHeadBytes + image::RoleBodyBytes(bytes_ + at + image::kRoleCountsAt);
  }
  for (int i = 0; i < out_.num_roles_; ++i) {
    const int parent = out_.roles_[i].parent;
    const int expected = parent < 0 ? 0 : depths[parent] + 1;
    if (depths[i] != expected) {
      return Fail("roles extend each other in a circle", SectionOf(bytes_, Section::kRoles).begin);
    }
  }
  // There are no circles any more, so this ends.
  for (int i = 0; i < out_.num_roles_; ++i) {
    for (int role = i; role >= 0; role = out_.roles_[role].parent) {
      ancestors_[i] |= uint64_t{1} << role;
    }
  }
  return true;
}

// True if calls of the one function may reach the other.
bool Verifier::SameSignature(int function, int other) const {
  const FunctionInfo& a = out_.functions_[function];
  const FunctionInfo& b = out_.functions_[other];
  if (a.num_arguments != b.num_arguments || a.return_type != b.return_type) return false;
  for (int i = 0; i < a.num_arguments; ++i) {
    if (a.local_types[i] != b.local_types[i]) return false;
  }
  return true;
}

// Slots are shared: what a parent has in a slot, its subroles have there too, of the same type.
bool Verifier::CheckAgainstParent(const RoleInfo& role, const RoleInfo& parent) {
  const uint32_t at = SectionOf(bytes_, Section::kRoles).begin;
  // A role has all that it inherits, in the same slots, and its own behind it.
  if (role.num_fields < parent.num_fields || role.num_labels < parent.num_labels ||
      role.num_commands < parent.num_commands || role.num_methods < parent.num_methods) {
    return Fail("role lacks members of the role it extends", at);
  }
  for (int i = 0; i < parent.num_fields; ++i) {
    if (role.field_types[i] != parent.field_types[i]) return Fail("inherited field differs", at);
  }
  for (int i = 0; i < parent.num_labels; ++i) {
    if (role.labels[i].type != parent.labels[i].type) return Fail("inherited label differs", at);
  }
  for (int i = 0; i < parent.num_commands; ++i) {
    if (!SameSignature(role.commands[i].function, parent.commands[i].function)) {
      return Fail("inherited command has other arguments", at);
    }
  }
  for (int i = 0; i < parent.num_methods; ++i) {
    if (!SameSignature(role.methods[i], parent.methods[i])) {
      return Fail("inherited function has other types", at);
    }
  }
  return true;
}

// The role in whose braces the function stands.
int Verifier::OwnerOf(int function) const {
  const uint32_t at = SectionOf(bytes_, Section::kFunctions).begin +
                      static_cast<uint32_t>(function) * image::kFunctionBytes;
  return bytes_[at + image::kFunctionRoleAt];
}

// A function reads fields and labels by its owner's slots, so a role may use only functions of its
// own and of the roles that it extends, those that it inherits included.
bool Verifier::CheckOwners() {
  bool all = true;
  for (int i = 0; i < out_.num_roles_; ++i) {
    ForEachFunction(out_.roles_[i], [&](int function) {
      all = all && (ancestors_[i] >> OwnerOf(function) & 1) != 0;
    });
  }
  return all || Fail("role uses a function of an unrelated role",
                     SectionOf(bytes_, Section::kRoles).begin);
}

// Which keywords a role needs is found here and not read, so that it cannot be wrong.
void Verifier::CollectKeywords(int index) {
  RoleInfo& role = out_.roles_[index];
  uint64_t used = 0;
  ForEachFunction(role, [&](int function) { used |= keywords_used_[function]; });
  // In order of the program's table.
  role.num_keywords = 0;
  for (int i = 0; i < kMaxKeywords; ++i) {
    if ((used >> i & 1) != 0) role.keywords[role.num_keywords++] = static_cast<uint8_t>(i);
  }
}

}  // namespace morphbus::vm
